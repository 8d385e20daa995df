#pragma once

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "modules/pose_graph/member_solver.hpp"

namespace km {

/// A member's solver, and who listens to what it sends.
class OverheardMember final : public MemberSolver {
 public:
  using Listener = std::function<void(const SolverLetter&)>;

  OverheardMember(std::unique_ptr<MemberSolver> member, Listener listener)
      : member_(std::move(member)), listener_(std::move(listener)) {}

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override {
    return member_->receive(from, bytes);
  }
  [[nodiscard]] bool ready() const override { return member_->ready(); }
  [[nodiscard]] std::vector<SolverLetter> advance() override {
    std::vector<SolverLetter> letters = member_->advance();
    for (const SolverLetter& letter : letters) listener_(letter);
    return letters;
  }
  [[nodiscard]] bool done() const override { return member_->done(); }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return member_->poses(); }
  [[nodiscard]] SolverState state() const override { return member_->state(); }
  [[nodiscard]] ClosureVerdicts verdicts() const override { return member_->verdicts(); }

 private:
  std::unique_ptr<MemberSolver> member_;
  Listener listener_;
};

}  // namespace km
