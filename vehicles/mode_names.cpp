#include "vehicles/mode_names.hpp"

namespace tiltrim {

std::shared_ptr<const std::vector<ModeName>> aircraft_modes() {
  static const std::shared_ptr<const std::vector<ModeName>> names =
      std::make_shared<const std::vector<ModeName>>(std::vector<ModeName>{
          {"short period", {"theta", "q"}, true},
          {"short period", {"alpha", "q"}, true},
          {"short period", {"w", "q"}, true},
          {"phugoid", {"V", "gamma"}, true},
          {"phugoid", {"V", "theta"}, true},
          {"phugoid", {"u", "theta"}, true},
          {"speed and path", {"V_err", "gamma_err"}, true},
          {"both integrals", {"energy_integral", "distribution_integral"}, true},
          {"speed", {"V"}},
          {"speed", {"V_err"}},
          {"speed", {"u"}},
          {"heave", {"w"}},
          {"flight path", {"gamma"}},
          {"flight path", {"gamma_err"}},
          {"pitch", {"theta"}},
          {"pitch rate", {"q"}},
          {"energy integral", {"energy_integral"}},
          {"distribution integral", {"distribution_integral"}},
          {"dutch roll", {"beta", "r"}, true},
          {"dutch roll", {"v", "r"}, true},
          {"roll-spiral oscillation", {"p", "phi"}, true},
          {"roll", {"p"}, false, {"phi"}},
          {"spiral", {"phi"}, false, {"p"}},
          {"heading", {"psi"}, false, {"r"}},
      });
  return names;
}

}  // namespace tiltrim
