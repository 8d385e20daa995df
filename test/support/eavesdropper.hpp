#pragma once

#include "apps/lab/pgo/member_team.hpp"
#include "modules/robust/member_solver.hpp"
#include "modules/robust/tree_messages.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "test/support/test.hpp"

namespace km {

/// A member's solver whose messages are passed to a listener.
class ObservedMember final : public MemberSolver {
 public:
  using Listener = std::function<void(const SolverMessage&)>;

  ObservedMember(std::unique_ptr<MemberSolver> member, Listener listener)
      : member_(std::move(member)), listener_(std::move(listener)) {}

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override {
    return member_->receive(from, bytes);
  }
  [[nodiscard]] bool ready() const override { return member_->ready(); }
  [[nodiscard]] std::vector<SolverMessage> advance() override {
    std::vector<SolverMessage> messages = member_->advance();
    for (const SolverMessage& message : messages) listener_(message);
    return messages;
  }
  [[nodiscard]] bool done() const override { return member_->done(); }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return member_->poses(); }
  [[nodiscard]] SolverState state() const override { return member_->state(); }
  [[nodiscard]] ClosureVerdicts verdicts() const override { return member_->verdicts(); }

 private:
  std::unique_ptr<MemberSolver> member_;
  Listener listener_;
};

// Poses that are connected by relative poses.
class Chains {
 public:
  void join(const KeyframeId& a, const KeyframeId& b) { parent_[root(a)] = root(b); }
  [[nodiscard]] KeyframeId root(KeyframeId a) {
    for (;;) {
      KeyframeId& up = parent_.try_emplace(a, a).first->second;
      if (up == a) return a;
      a = up = parent_.at(up);
    }
  }

 private:
  std::map<KeyframeId, KeyframeId> parent_;
};

// Decodes all messages between robots, as a reader of everything would.
class Eavesdropper {
 public:
  explicit Eavesdropper(const TeamGraph& graph) : dimension_(graph.dimension) {
    for (std::size_t k = 0; k < graph.robots(); ++k) {
      const auto robot = static_cast<RobotId>(k);
      for (Eigen::Index i = 0; i < graph.poses_of(k); ++i)
        all_.insert({robot, static_cast<KeyframeIndex>(i)});
      public_.insert({robot, 0});
      for (const PoseEdge& e : part_of(graph, k).between) public_.insert({e.from, e.to});
    }
  }

  // Adds the poses that the others have announced to a robot.
  void announced(const SessionGraph& part) {
    systems_.clear();
    for (const auto& [id, T] : part.public_poses) known_.insert(id);
  }

  void receive(RobotId from, const SolverMessage& message) {
    ++messages_;
    bytes_ += message.bytes->size();
    if (is_up_message(*message.bytes)) {
      const auto up = decode_up(*message.bytes);
      REQUIRE(up);
      receive(from, *up);
    } else {
      const auto down = decode_down(*message.bytes);
      REQUIRE(down);
      receive(message.to, *down);
    }
  }

  [[nodiscard]] const std::set<KeyframeId>& public_poses() const { return public_; }
  [[nodiscard]] std::set<KeyframeId> named_private() const { return without_public(named_); }
  [[nodiscard]] std::size_t private_poses() const { return all_.size() - public_.size(); }
  [[nodiscard]] std::size_t messages() const { return messages_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t sent_edges() const { return sent_edges_; }
  [[nodiscard]] std::size_t announced_poses() const { return known_.size(); }
  // Number of right-hand sides and steps whose size does not match the named poses.
  [[nodiscard]] std::size_t misfits() const { return misfits_; }

  // Private poses that are connected to an announced one, or to any other pose.
  [[nodiscard]] std::set<KeyframeId> derivable() {
    std::set<KeyframeId> from_known;
    for (const KeyframeId& id : known_) from_known.insert(chains_.root(id));
    std::map<KeyframeId, std::size_t> size;
    for (const KeyframeId& id : all_) ++size[chains_.root(id)];
    std::set<KeyframeId> found;
    for (const KeyframeId& id : all_) {
      const KeyframeId root = chains_.root(id);
      if (known_.contains(id) || from_known.contains(root) || size[root] > 1) found.insert(id);
    }
    return without_public(found);
  }

 private:
  void receive(RobotId from, const UpMessage& up) {
    if (up.system) {
      const TreeSystem& system = *up.system;
      systems_[from] = system.variables.size();
      for (const TreeVariable& v : system.variables) named_.insert(v.id);
      for (const SentEdge& e : system.edges) {
        ++sent_edges_;
        const auto& [i, j] = system.pairs[static_cast<std::size_t>(e.pair)];
        chains_.join(system.variables[static_cast<std::size_t>(i)].id,
                     system.variables[static_cast<std::size_t>(j)].id);
      }
    }
    check_size(from, up.reduced.size());
  }

  void receive(RobotId child, const DownMessage& down) { check_size(child, down.step.size()); }

  // The numbers belong to the poses that the child has named.
  void check_size(RobotId child, Eigen::Index size) {
    const auto known = systems_.find(child);
    const Eigen::Index block = dimension_ == 2 ? 3 : 6;
    const Eigen::Index expected =
        known == systems_.end() ? 0 : block * static_cast<Eigen::Index>(known->second);
    if (size != 0 && size != expected) ++misfits_;
  }

  [[nodiscard]] std::set<KeyframeId> without_public(const std::set<KeyframeId>& ids) const {
    std::set<KeyframeId> rest;
    for (const KeyframeId& id : ids)
      if (!public_.contains(id)) rest.insert(id);
    return rest;
  }

  int dimension_;
  std::set<KeyframeId> all_;
  std::set<KeyframeId> public_;
  std::set<KeyframeId> known_;  // announced
  std::set<KeyframeId> named_;  // named in messages
  Chains chains_;
  std::map<RobotId, std::size_t> systems_;  // by child: number of variables that it has named
  std::size_t messages_ = 0;
  std::size_t bytes_ = 0;
  std::size_t sent_edges_ = 0;
  std::size_t misfits_ = 0;
};

// Runs the default solver for at most `max_rounds` rounds.
inline Eavesdropper listen_to(const TeamGraph& graph, int max_rounds) {
  Eavesdropper ear(graph);
  const TreeNewtonOptions options{.dimension = graph.dimension};
  REQUIRE(options.robust);
  std::vector<SE3> start = chordal_initialisation(graph.poses(), graph.edges);
  MemberTeam team(graph, std::move(start), [&](SessionGraph part, TreePlace place) {
    const RobotId self = part.self;
    ear.announced(part);
    auto member = std::make_unique<TreeNewton>(std::move(part), std::move(place), options);
    return std::make_unique<ObservedMember>(
        std::move(member),
        [&ear, self](const SolverMessage& message) { ear.receive(self, message); });
  });
  RoundMeter meter(graph.robots(), {});
  for (int round = 0; round < max_rounds && team.step(meter); ++round) {
  }
  return ear;
}

}  // namespace km
