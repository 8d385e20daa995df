#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/team_messages.hpp"
#include "modules/rbcd/rounding.hpp"
#include "modules/rbcd/truncated_newton.hpp"

namespace km {

/// The simplest solver of a session, for tests of the layers below. All parts are gathered up the
/// tree at the root. In every round the root makes one Newton step of the whole graph and sends all
/// poses down. The next round begins when all members have confirmed their poses.
class GatherSolver final : public MemberSolver {
 public:
  struct Options {
    std::uint32_t max_rounds = 0;
    std::uint32_t fails_in_round = 0;     ///< If not 0.
    std::uint32_t gives_up_in_round = 0;  ///< If not 0, and the root.
    /// A closure with a larger residual at the end is called rejected.
    double largest_residual = std::numeric_limits<double>::infinity();
    std::set<ClosureId> rejects = {};  ///< Further closures to reject.
    double barc = 0.0;
    bool deferred = false;  ///< Fields of the reported SolverState.
    bool held = false;
  };

  GatherSolver(SessionGraph graph, TreePlace place, const Options& options)
      : graph_(std::move(graph)),
        place_(std::move(place)),
        options_(options),
        poses_(graph_.start) {}

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override {
    ByteReader in(bytes);
    const std::uint32_t round = in.u32();
    if (in.failed() || round > 100000) return false;
    const std::vector<std::uint8_t> rest(bytes.begin() + 4, bytes.end());
    if (place_.parent == from) {
      if (rest.size() < 25) return false;
      downs_.emplace(round, rest);
    } else if (std::find(place_.children.begin(), place_.children.end(), from) !=
               place_.children.end()) {
      ups_[round].emplace(from, rest);
    } else {
      return false;
    }
    return true;
  }

  [[nodiscard]] bool ready() const override {
    if (done_) return false;
    if (waits_for_down_) return downs_.contains(round_);
    const auto ups = ups_.find(round_);
    return (ups == ups_.end() ? 0 : ups->second.size()) == place_.children.size();
  }

  [[nodiscard]] std::vector<SolverMessage> advance() override {
    if (options_.fails_in_round > 0 && round_ >= options_.fails_in_round)
      throw std::runtime_error("as requested by the test");
    if (options_.gives_up_in_round > 0 && round_ >= options_.gives_up_in_round) {
      done_ = failed_ = true;
      return {};
    }
    return waits_for_down_ ? go_down(downs_.at(round_)) : go_up();
  }

  [[nodiscard]] bool done() const override { return done_; }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return poses_; }
  [[nodiscard]] SolverState state() const override {
    return {.round = complete_,
            .cost = cost_,
            .gradient = gradient_,
            .barc = options_.barc,
            .deferred = options_.deferred,
            .held = options_.held,
            .failed = failed_};
  }
  [[nodiscard]] ClosureVerdicts verdicts() const override {
    ClosureVerdicts verdicts;
    for (const PoseEdge& e : graph_.between)
      if (graph_.self == std::min(e.from.robot, e.to.robot)) {
        const auto residual = residuals_.find(e.id());
        const bool near =
            residual == residuals_.end() || residual->second <= options_.largest_residual;
        verdicts.closures.push_back({e.id(), near && !options_.rejects.contains(e.id())});
      }
    return verdicts;
  }

 private:
  struct Part {
    std::vector<SE3> poses;
    std::vector<PoseEdge> edges;  // for a closure between robots, only one end's edge
    std::vector<std::pair<PoseEdge, SE3>> to_absent;  // with the pose at the absent robot
    std::map<ClosureId, bool> decided;
  };

  static void put(ByteWriter& out, const SE3& T) {
    for (const double x : T.matrix().topRows<3>().reshaped()) out.f64(x);
  }
  static SE3 pose(ByteReader& in) {
    SE3 T = SE3::Identity();
    for (int col = 0; col < 4; ++col)
      for (int row = 0; row < 3; ++row) T.matrix()(row, col) = in.f64();
    return T;
  }
  static void put(ByteWriter& out, const PoseEdge& e) {
    for (const KeyframeId& id : {e.from, e.to}) {
      out.u16(id.robot);
      out.u32(id.index);
    }
    put(out, e.T_from_to);
    out.f64(e.precision.kappa);
    out.f64(e.precision.tau);
  }
  static PoseEdge edge(ByteReader& in) {
    PoseEdge e;
    e.from = KeyframeId{in.u16(), in.u32()};
    e.to = KeyframeId{in.u16(), in.u32()};
    e.T_from_to = pose(in);
    e.precision = Precision{in.f64(), in.f64()};
    return e;
  }

  [[nodiscard]] std::vector<std::uint8_t> own_part() const {
    ByteWriter out;
    out.u16(graph_.self);
    out.varint(graph_.start.size());
    for (const SE3& T : graph_.start) put(out, T);
    std::vector<PoseEdge> edges = graph_.own;
    for (const PoseEdge& e : graph_.between)
      if (graph_.self == std::min(e.from.robot, e.to.robot)) edges.push_back(e);
    out.varint(edges.size());
    for (PoseEdge e : edges) {
      const auto decided = graph_.decided.find(e.id());
      if (decided != graph_.decided.end() && !decided->second) {
        e.precision.kappa *= kRejectedWeight;
        e.precision.tau *= kRejectedWeight;
      }
      put(out, e);
    }
    out.varint(graph_.to_absent.size());
    for (const PoseEdge& e : graph_.to_absent) {
      put(out, e);
      put(out, graph_.public_poses.at(e.other(graph_.self)));
    }
    return out.release();
  }

  void read_parts(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    while (in.left() > 0) {
      Part& part = parts_[in.u16()];
      part = {};
      for (std::size_t k = in.count(100000, 96); k > 0; --k) part.poses.push_back(pose(in));
      for (std::size_t k = in.count(100000, 96); k > 0; --k) part.edges.push_back(edge(in));
      for (std::size_t k = in.count(100000, 96); k > 0; --k) {
        const PoseEdge e = edge(in);
        part.to_absent.emplace_back(e, pose(in));
      }
    }
    if (!in.done()) throw std::runtime_error("a message that cannot be read");
  }

  SolverMessage message_to(RobotId to, const std::vector<std::uint8_t>& rest) const {
    auto bytes = std::make_shared<std::vector<std::uint8_t>>(4 + rest.size());
    for (std::size_t k = 0; k < 4; ++k) (*bytes)[k] = static_cast<std::uint8_t>(round_ >> (8U * k));
    std::copy(rest.begin(), rest.end(), bytes->begin() + 4);
    return {to, std::move(bytes)};
  }

  std::vector<SolverMessage> go_up() {
    std::vector<std::uint8_t> gathered;
    if (round_ == 0) {
      gathered = own_part();
      for (const auto& [child, bytes] : ups_[round_])
        gathered.insert(gathered.end(), bytes.begin(), bytes.end());
    }
    if (place_.parent) {
      waits_for_down_ = true;
      return {message_to(*place_.parent, gathered)};
    }
    if (round_ == 0) {
      read_parts(gathered);
      build();
    } else {
      const auto result = minimise(*problem_, X_,
                                   {.max_iterations = 1,
                                    .max_cg_iterations = 300,
                                    .cg_tolerance = 1e-3,
                                    .gradient_tolerance = 1e-7});
      X_ = result.X;
      converged_ = result.converged;
      cost_ = result.cost;
      gradient_ = result.gradient_norm;
    }
    return go_down(solution());
  }

  std::vector<SolverMessage> go_down(const std::vector<std::uint8_t>& bytes) {
    ByteReader in(bytes);
    cost_ = in.f64();
    gradient_ = in.f64();
    const bool last = in.u8() > 0;
    std::map<RobotId, std::vector<SE3>> all;
    while (in.left() > 0) {
      std::vector<SE3>& of_robot = all[in.u16()];
      for (std::size_t k = in.count(100000, 96); k > 0; --k) of_robot.push_back(pose(in));
    }
    if (!in.done() || all[graph_.self].size() != poses_.size())
      throw std::runtime_error("poses that cannot be read");
    poses_ = all.at(graph_.self);
    for (const PoseEdge& e : graph_.between) {
      const double cost = edge_cost(all[e.from.robot].at(e.from.index).matrix().topRows<3>(),
                                    all[e.to.robot].at(e.to.index).matrix().topRows<3>(),
                                    e.T_from_to, e.precision.kappa, e.precision.tau);
      residuals_[e.id()] = std::sqrt(cost);
    }
    std::vector<SolverMessage> messages;
    for (const RobotId child : place_.children) messages.push_back(message_to(child, bytes));
    complete_ = round_++;
    waits_for_down_ = false;
    done_ = last;
    return messages;
  }

  void build() {
    std::map<RobotId, Eigen::Index> first;
    Eigen::Index count = 0;
    std::vector<SE3> start;
    for (const auto& [robot, part] : parts_) {
      first[robot] = count;
      count += static_cast<Eigen::Index>(part.poses.size());
      start.insert(start.end(), part.poses.begin(), part.poses.end());
    }
    const auto at = [&](const KeyframeId& id) { return first.at(id.robot) + id.index; };
    std::vector<BlockEdge> edges;
    std::vector<PublicEdge> to_fixed;
    std::vector<SE3> fixed;
    for (const auto& [robot, part] : parts_) {
      for (const PoseEdge& e : part.edges)
        edges.push_back({at(e.from), at(e.to), e.T_from_to, e.precision.kappa, e.precision.tau});
      for (const auto& [e, T] : part.to_absent) {
        to_fixed.push_back({at(e.end_on(robot)), static_cast<Eigen::Index>(fixed.size()),
                            e.from.robot == robot, e.T_from_to, e.precision.kappa,
                            e.precision.tau});
        fixed.push_back(T);
      }
    }
    problem_ = std::make_unique<QuadraticProblem>(3, count, edges, to_fixed);
    problem_->set_fixed(lift(fixed, 3));
    X_ = lift(start, 3);
    cost_ = problem_->cost(X_);
  }

  [[nodiscard]] std::vector<std::uint8_t> solution() const {
    const std::vector<SE3> poses = round_to_poses(X_, lifted_identity(3));
    const bool last =
        converged_ || (options_.max_rounds > 0 && round_ >= options_.max_rounds) || round_ > 200;
    ByteWriter out;
    out.f64(cost_);
    out.f64(gradient_);
    out.u8(last ? 1 : 0);
    std::size_t next = 0;
    for (const auto& [robot, part] : parts_) {
      out.u16(robot);
      out.varint(part.poses.size());
      for (std::size_t k = 0; k < part.poses.size(); ++k) put(out, poses[next++]);
    }
    return out.release();
  }

  SessionGraph graph_;
  TreePlace place_;
  Options options_;
  std::vector<SE3> poses_;
  std::map<std::uint32_t, std::map<RobotId, std::vector<std::uint8_t>>> ups_;  // by round
  std::map<std::uint32_t, std::vector<std::uint8_t>> downs_;
  std::map<ClosureId, double> residuals_;
  std::uint32_t round_ = 0;
  std::uint32_t complete_ = 0;
  bool waits_for_down_ = false;
  bool done_ = false;
  bool failed_ = false;
  double cost_ = 0.0;
  double gradient_ = 0.0;
  // At the root only.
  std::map<RobotId, Part> parts_;
  std::unique_ptr<QuadraticProblem> problem_;
  LiftedPoses X_;
  bool converged_ = false;
};

}  // namespace km
