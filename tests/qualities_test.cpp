#include "qualities/qualities.hpp"
#include <iostream>
#include "tests/check.hpp"
using namespace tiltrim;
TEST_CASE("try") {
  LinearModel l; l.status=LinearizeStatus::linear;
  l.A.resize(4,4);
  l.A << -0.006868, 0.01395, 0, -32.2, -0.09055, -0.3151, 773.98, 0, 0.0001187, -0.001026, -0.4285,
      0, 0, 0, 1, 0;
  l.B=Eigen::Vector4d(-0.000187, -17.85, -1.158, 0);
  l.A_error=l.A*0; l.B_error=l.B*0; l.C.resize(0,4); l.D.resize(0,1);l.C_error.resize(0,4); l.D_error.resize(0,1);
  l.states={{"u","",10},{"w","",10},{"q","",.1},{"theta","",.1}};
  l.inputs={{"de","",.1}};
  QualitiesOptions o; o.roles={"theta","q","","w","u","","","de"}; o.airspeed=774; o.gravity=32.2;
  auto q=qualities(l,o);
  for (auto& c: q.criteria) std::cout<<c.name<<" "<<c.value<<" +- "<<c.error<<" level "<<to_string(c.level)<<" d "<<c.distance()<<" "<<c.remark<<"\n";
  std::cout<<to_string(q.level)<<" n/a "<<q.n_per_alpha.value<<" "<<q.n_per_alpha.error<<"\n";
  for(auto&r:q.remarks) std::cout<<r<<"\n";
  std::cout<<q.bandwidth.bandwidth.value<<" "<<q.bandwidth.phase_delay.value<<"\n";
}
