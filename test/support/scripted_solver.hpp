#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/robust/member_solver.hpp"
#include "modules/robust/tree_newton.hpp"

namespace km {

/// A solver of a session for tests of the layers below. It reaches the optimum of the closures that
/// the first look has not rejected. The test decides which closures it rejects, what it reports,
/// and whether it fails.
class ScriptedSolver final : public MemberSolver {
 public:
  struct Options {
    std::uint32_t max_rounds = 0;         ///< If not 0.
    std::uint32_t fails_in_round = 0;     ///< If not 0.
    std::uint32_t gives_up_in_round = 0;  ///< If not 0.
    std::set<ClosureId> rejects = {};
    double barc = 0.0;  ///< Fields of the reported SolverState.
    bool deferred = false;
  };

  ScriptedSolver(SessionGraph graph, TreePlace place, Options options)
      : self_(graph.self), between_(graph.between), options_(std::move(options)) {
    for (auto* edges : {&graph.own, &graph.between})
      for (PoseEdge& e : *edges)
        if (const auto decided = graph.decided.find(e.id());
            decided != graph.decided.end() && !decided->second) {
          e.precision.kappa *= kRejectedWeight;
          e.precision.tau *= kRejectedWeight;
        }
    TreeNewtonOptions trusting{.robust = false, .covariances = false};
    if (options_.max_rounds > 0) trusting.max_rounds = options_.max_rounds;
    solver_ = std::make_unique<TreeNewton>(std::move(graph), std::move(place), trusting);
  }

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override {
    return solver_->receive(from, bytes);
  }
  [[nodiscard]] bool ready() const override { return !failed_ && solver_->ready(); }
  [[nodiscard]] std::vector<SolverMessage> advance() override {
    const std::uint32_t round = solver_->state().round;
    if (options_.fails_in_round > 0 && round >= options_.fails_in_round)
      throw std::runtime_error("as requested by the test");
    failed_ = options_.gives_up_in_round > 0 && round >= options_.gives_up_in_round;
    return failed_ ? std::vector<SolverMessage>() : solver_->advance();
  }
  [[nodiscard]] bool done() const override { return failed_ || solver_->done(); }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return solver_->poses(); }
  [[nodiscard]] SolverState state() const override {
    SolverState state = solver_->state();
    state.barc = options_.barc;
    state.deferred = options_.deferred;
    state.failed = failed_;
    return state;
  }
  [[nodiscard]] ClosureVerdicts verdicts() const override {
    ClosureVerdicts verdicts;
    for (const PoseEdge& e : between_)
      if (self_ == std::min(e.from.robot, e.to.robot))
        verdicts.closures.push_back({e.id(), !options_.rejects.contains(e.id())});
    return verdicts;
  }

 private:
  RobotId self_;
  std::vector<PoseEdge> between_;
  Options options_;
  std::unique_ptr<TreeNewton> solver_;
  bool failed_ = false;
};

}  // namespace km
