/// The third trim formulation of the tiltrotor, the rows of the paper's Table 2.
#pragma once

#include "trim/trim.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Formulation 3: given coefficients as in Table 2. theta0, a1s and the dynamic pressure as a
/// fraction k of the weight solve the first two rows of (15) as printed; the third gives the moment
/// increment required from an elevator.
struct TableCondition {
  double gamma, alpha, eta;  ///< rad
  double CL, CD, CM;         ///< CL positive down, as printed
  double k;                  ///< ½ρ(V + vi)²S / (m g)
};
/// The result of trim_table().
struct TableTrim {
  TrimResult trim;     ///< of table_model()
  double theta0, a1s;  ///< theta0: fraction of full thrust; a1s: rad
  double CM_required;  ///< balances the thrust's moment about the centre of gravity
  double CM_elevator;  ///< CM_required - CM: required from the elevator
};
/// Rows one and two of (15) as printed, divided by the weight: inputs theta0, a1s.
Model table_model(const TableCondition& condition, double thrust_excess);
/// Solves formulation 3.
[[nodiscard]] TableTrim trim_table(const Vehicle& vehicle, const TableCondition& condition,
                                   const TrimOptions& options = {});

}  // namespace tiltrim
