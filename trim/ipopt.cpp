#include "trim/ipopt.hpp"

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "runtime/memory.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double ipopt_infinity = 2e19;  // Ipopt's value for no bound

// Ipopt's callback protocol, over dense matrices in row-major order.
class DenseNlp final : public Ipopt::TNLP {
 public:
  DenseNlp(const Nlp& nlp, const VectorXd& start, const std::stop_token& stop)
      : nlp_(nlp), n_(start.size()), m_(nlp.c_lower.size()), z_(start), stop_(stop) {}

  const VectorXd& point() const { return z_; }

  bool get_nlp_info(int& n, int& m, int& nnz_jac, int& nnz_hess, IndexStyleEnum& style) override {
    n = int(n_);
    m = int(m_);
    nnz_jac = n * m;
    nnz_hess = n * (n + 1) / 2;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(int n, double* lower, double* upper, int m, double* c_lower,
                       double* c_upper) override {
    const auto copy = [](const VectorXd& from, double* to, int count) {
      for (int i = 0; i < count; ++i) to[i] = std::clamp(from[i], -ipopt_infinity, ipopt_infinity);
    };
    copy(nlp_.lower, lower, n);
    copy(nlp_.upper, upper, n);
    copy(nlp_.c_lower, c_lower, m);
    copy(nlp_.c_upper, c_upper, m);
    return true;
  }

  bool get_starting_point(int, bool, double* z, bool, double*, double*, int, bool,
                          double*) override {
    Eigen::Map<VectorXd>(z, n_) = z_;
    return true;
  }

  bool eval_f(int, const double* z, bool, double& f) override {
    VectorXd c;
    return nlp_.values(at(z), f, c) && std::isfinite(f);
  }

  bool eval_grad_f(int, const double* z, bool, double* gradient) override {
    VectorXd g;
    MatrixXd J;
    if (!nlp_.slopes(at(z), g, J)) return false;
    Eigen::Map<VectorXd>(gradient, n_) = g;
    return true;
  }

  bool eval_g(int, const double* z, bool, int, double* c) override {
    double f = 0;
    VectorXd values;
    if (!nlp_.values(at(z), f, values)) return false;
    Eigen::Map<VectorXd>(c, m_) = values;
    return true;
  }

  bool eval_jac_g(int, const double* z, bool, int, int, int* rows, int* cols,
                  double* entries) override {
    if (!entries) {
      for (int i = 0, k = 0; i < m_; ++i)
        for (int j = 0; j < n_; ++j, ++k) rows[k] = i, cols[k] = j;
      return true;
    }
    VectorXd g;
    MatrixXd J;
    if (!nlp_.slopes(at(z), g, J)) return false;
    for (Index i = 0, k = 0; i < m_; ++i)
      for (Index j = 0; j < n_; ++j, ++k) entries[k] = J(i, j);
    return true;
  }

  bool eval_h(int, const double* z, bool, double sigma, int, const double* lambda, bool, int,
              int* rows, int* cols, double* entries) override {
    if (!entries) {
      for (int i = 0, k = 0; i < n_; ++i)
        for (int j = 0; j <= i; ++j, ++k) rows[k] = i, cols[k] = j;
      return true;
    }
    MatrixXd H;
    if (!nlp_.hessian(at(z), sigma, Eigen::Map<const VectorXd>(lambda, m_), H)) return false;
    for (Index i = 0, k = 0; i < n_; ++i)
      for (Index j = 0; j <= i; ++j, ++k) entries[k] = H(i, j);
    return true;
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, int, double, double, double, double, double,
                             double, double, double, int, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    return !stop_.stop_requested();
  }

  void finalize_solution(Ipopt::SolverReturn, int, const double* z, const double*, const double*,
                         int, const double*, const double*, double, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    z_ = at(z);
  }

 private:
  VectorXd at(const double* z) const { return Eigen::Map<const VectorXd>(z, n_); }

  const Nlp& nlp_;
  Index n_, m_;
  VectorXd z_;
  const std::stop_token& stop_;
};

Ipopt::SmartPtr<Ipopt::IpoptApplication> application() {
  // MUMPS takes some 2 MB for every factorization and frees them: as long as the rest of a solve.
  keep_freed_memory(16 << 20);
  Ipopt::SmartPtr<Ipopt::IpoptApplication> app = new Ipopt::IpoptApplication(false);
  const auto& options = app->Options();
  options->SetIntegerValue("print_level", 0);
  options->SetStringValue("sb", "yes");
  options->SetNumericValue("tol", 1e-8);  // Newton refines the result
  options->SetNumericValue("bound_relax_factor", 0.0);
  options->SetNumericValue("mu_init", 1e-3);              // starts are close and scaled: a small
  options->SetStringValue("nlp_scaling_method", "none");  // barrier saves half the iterations
  options->SetStringValue("linear_solver", "mumps");
  options->SetIntegerValue("mumps_mem_percent", 5);  // its default, 1000, takes 4 MB more
  app->Initialize("");
  return app;
}

}  // namespace

VectorXd ipopt(const Nlp& nlp, const VectorXd& start, int max_iterations,
               const std::stop_token& stop) {
  static std::mutex one_at_a_time;
  const std::scoped_lock lock(one_at_a_time);
  static const Ipopt::SmartPtr<Ipopt::IpoptApplication> app = application();
  app->Options()->SetIntegerValue("max_iter", max_iterations);
  const Ipopt::SmartPtr<Ipopt::TNLP> problem = new DenseNlp(nlp, start, stop);
  app->OptimizeTNLP(problem);  // its status is not used
  const VectorXd z = static_cast<DenseNlp&>(*problem).point();
  return z.allFinite() ? z : start;
}

}  // namespace tiltrim
