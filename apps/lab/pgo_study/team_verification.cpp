#include "apps/lab/pgo_study/team_verification.hpp"

#include <cmath>
#include <limits>

#include "apps/lab/pgo_study/certificate_agent.hpp"
#include "apps/lab/pgo_study/message_sizes.hpp"

namespace km {
namespace {

constexpr double kNegligibleGap = 1e-4;
constexpr std::size_t kWindow = 10;

class Verifiers {
 public:
  Verifiers(const TeamGraph& graph, const LiftedPoses& X, RoundMeter& meter) : meter_(meter) {
    for (std::size_t k = 0; k < graph.robots(); ++k) {
      agents_.emplace_back(part_of(graph, k),
                           X.middleCols(4 * graph.first[k], 4 * graph.poses_of(k)),
                           static_cast<std::uint32_t>(16 * k + static_cast<std::size_t>(X.rows())));
    }
  }

  // Every robot sends the result of `columns_of(agent)` to all others.
  template <typename F>
  void exchange_columns(const F& columns_of) {
    for (std::size_t k = 0; k < agents_.size(); ++k) {
      const LiftedPoses columns = meter_.run(k, [&] { return columns_of(agents_[k]); });
      meter_.sent(kMessageHeader + bytes_of_doubles(columns.size()));
      for (std::size_t peer = 0; peer < agents_.size(); ++peer)
        if (peer != k)
          meter_.run(peer, [&] {
            agents_[peer].set_neighbour(static_cast<RobotId>(k), agents_[k].public_keyframes(),
                                        columns);
          });
    }
  }

  // Sums the results of `part_of(agent)` over the team, in the order of the robots.
  template <typename F>
  Eigen::MatrixXd sum(const F& part_of) {
    Eigen::MatrixXd total;
    for (std::size_t k = 0; k < agents_.size(); ++k) {
      const Eigen::MatrixXd part = meter_.run(k, [&] { return part_of(agents_[k]); });
      meter_.sent(kMessageHeader + bytes_of_doubles(part.size()));
      total = k == 0 ? part : Eigen::MatrixXd(total + part);
    }
    return total;
  }

  CertificateState iterate() {
    exchange_columns([](const CertificateAgent& agent) { return agent.public_direction(); });
    const Eigen::MatrixXd sums =
        sum([](CertificateAgent& agent) { return agent.iteration_sums(); });
    CertificateState state;
    for (std::size_t k = 0; k < agents_.size(); ++k)
      state = meter_.run(k, [&] { return agents_[k].iterate(sums); });
    return state;
  }

  void prepare() {
    exchange_columns([](const CertificateAgent& agent) { return agent.public_poses(); });
    const Eigen::MatrixXd gram = sum([](CertificateAgent& agent) { return agent.kernel_sums(); });
    for (std::size_t k = 0; k < agents_.size(); ++k)
      meter_.run(k, [&] { agents_[k].set_kernel(gram); });
  }

  [[nodiscard]] const std::vector<CertificateAgent>& agents() const { return agents_; }

 private:
  RoundMeter& meter_;
  std::vector<CertificateAgent> agents_;
};

}  // namespace

TeamVerification verify_team(const TeamGraph& graph, const LiftedPoses& X,
                             const VerificationOptions& options, const TeamMeter& meter) {
  RoundMeter round_meter(graph.robots(), meter);
  TeamVerification result;
  const auto finish_rounds = [&](int rounds) {
    result.rounds += rounds;
    result.work += round_meter.finish_round();
  };
  Verifiers verifiers(graph, X, round_meter);
  verifiers.prepare();
  finish_rounds(2);
  const CertificateAgent& first = verifiers.agents().front();
  const double negligible = kNegligibleGap * first.team_cost() / (3.0 * first.team_poses());
  std::vector<double> quotients;
  const auto gain_over = [&](std::size_t iterations) {
    return quotients.size() > iterations
               ? quotients[quotients.size() - 1 - iterations] - quotients.back()
               : std::numeric_limits<double>::infinity();
  };
  bool ended = false;
  for (int k = 0; k < options.max_iterations && !ended; ++k) {
    const CertificateState state = verifiers.iterate();
    finish_rounds(2);
    quotients.push_back(state.lambda);
    result.lambda_min = state.lambda;
    result.negative = state.lambda < -negligible;
    result.converged =
        gain_over(kWindow) <= options.tolerance * std::abs(state.lambda) + 0.1 * negligible;
    // A negative quotient suffices; it need not be the smallest.
    ended = result.converged || (result.negative && gain_over(2) < -0.1 * state.lambda);
  }
  result.direction.resize(1, X.cols());
  for (std::size_t k = 0; k < graph.robots(); ++k)
    result.direction.middleCols(4 * graph.first[k], 4 * graph.poses_of(k)) =
        verifiers.agents()[k].vector();
  return result;
}

}  // namespace km
