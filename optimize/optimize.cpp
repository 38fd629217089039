#include "optimize/optimize.hpp"

#include <exception>
#include <nlopt.hpp>
#include <stdexcept>
#include <vector>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

nlopt::algorithm named(Optimizer algorithm) {
  switch (algorithm) {
    case Optimizer::crs2:
      return nlopt::GN_CRS2_LM;
    case Optimizer::isres:
      return nlopt::GN_ISRES;
    case Optimizer::esch:
      return nlopt::GN_ESCH;
    case Optimizer::direct:
      return nlopt::GN_DIRECT_L;
    case Optimizer::mlsl:
      return nlopt::G_MLSL_LDS;
    case Optimizer::slsqp:
      return nlopt::LD_SLSQP;
    case Optimizer::mma:
      return nlopt::LD_MMA;
    case Optimizer::bobyqa:
      return nlopt::LN_BOBYQA;
    case Optimizer::cobyla:
      return nlopt::LN_COBYLA;
    case Optimizer::sbplx:
      return nlopt::LN_SBPLX;
  }
  return nlopt::LN_COBYLA;
}

// The callbacks for NLopt; no exception may cross its C frames.
struct Calls {
  const Optimization& problem;
  nlopt::opt& optimizer;
  std::exception_ptr thrown{};

  void guarded(const auto& work) {
    if (thrown) return;
    try {
      work();
    } catch (...) {
      thrown = std::current_exception();
      optimizer.force_stop();
    }
  }

  static double value(const std::vector<double>& x, std::vector<double>& slope, void* self) {
    auto& calls = *static_cast<Calls*>(self);
    double f = HUGE_VAL;
    calls.guarded([&] {
      VectorXd g = VectorXd::Zero(Index(slope.size()));
      const Eigen::Map<const VectorXd> at(x.data(), Index(x.size()));
      f = calls.problem.objective(at, slope.empty() ? nullptr : &g);
      std::copy(g.begin(), g.end(), slope.begin());
    });
    return f;
  }

  void constraints(const Optimization::Constraints& of, unsigned m, double* result, unsigned n,
                   const double* x, double* slopes) {
    std::fill_n(result, m, 0.0);
    if (slopes) std::fill_n(slopes, std::size_t(m) * n, 0.0);
    guarded([&] {
      VectorXd c = VectorXd::Zero(Index(m));
      MatrixXd J = MatrixXd::Zero(slopes ? Index(m) : 0, Index(n));
      of(Eigen::Map<const VectorXd>(x, Index(n)), c, slopes ? &J : nullptr);
      std::copy(c.begin(), c.end(), result);
      for (Index i = 0; slopes && i < Index(m); ++i)
        for (Index j = 0; j < Index(n); ++j) slopes[i * Index(n) + j] = J(i, j);
    });
  }
  static void inequality(unsigned m, double* result, unsigned n, const double* x, double* slopes,
                         void* self) {
    auto& calls = *static_cast<Calls*>(self);
    calls.constraints(calls.problem.inequality, m, result, n, x, slopes);
  }
  static void equality(unsigned m, double* result, unsigned n, const double* x, double* slopes,
                       void* self) {
    auto& calls = *static_cast<Calls*>(self);
    calls.constraints(calls.problem.equality, m, result, n, x, slopes);
  }
};

std::vector<double> listed(const VectorXd& v) { return {v.begin(), v.end()}; }

}  // namespace

void optimize(const Optimization& problem) {
  nlopt::srand(static_cast<unsigned long>(problem.seed));
  const auto n = static_cast<unsigned>(problem.start.size());
  nlopt::opt optimizer(named(problem.algorithm), n);
  Calls calls{problem, optimizer};
  optimizer.set_min_objective(Calls::value, &calls);
  optimizer.set_lower_bounds(listed(problem.lower));
  optimizer.set_upper_bounds(listed(problem.upper));
  const auto within = [&](Index m) {
    return std::vector<double>(std::size_t(m), problem.constraint_tolerance);
  };
  if (problem.inequalities > 0)
    optimizer.add_inequality_mconstraint(Calls::inequality, &calls, within(problem.inequalities));
  if (problem.equalities > 0)
    optimizer.add_equality_mconstraint(Calls::equality, &calls, within(problem.equalities));
  optimizer.set_xtol_rel(problem.step_tolerance);
  optimizer.set_maxeval(problem.evaluations);
  if (problem.first_step > 0) optimizer.set_initial_step(problem.first_step);
  if (problem.algorithm == Optimizer::mlsl) {
    nlopt::opt local(nlopt::LD_SLSQP, n);
    local.set_xtol_rel(problem.step_tolerance);
    optimizer.set_local_optimizer(local);
  }
  std::vector<double> x = listed(problem.start.cwiseMax(problem.lower).cwiseMin(problem.upper));
  double value = 0.0;
  try {
    optimizer.optimize(x, value);
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::exception&) {  // rounding, a forced stop: the caller has the best point
  }
  if (calls.thrown) std::rethrow_exception(calls.thrown);
}

}  // namespace tiltrim
