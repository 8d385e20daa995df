#include "modules/pose_graph/robust/isolated_closures.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>

namespace km {
namespace {

using Eigen::Index;

constexpr Index kBeside = 5;  // poses, at both ends

// A closure from its lower pose to its upper one.
struct Closure {
  std::size_t edge = 0;
  Index lower = 0;
  Index upper = 0;
  SE3 T_lower_upper;
  double kappa = 1.0;
  double tau = 1.0;
};

class Corroboration {
 public:
  Corroboration(const TeamGraph& graph, const std::vector<bool>& odometry, double barc)
      : graph_(graph), barc_(barc), step_(static_cast<std::size_t>(graph.poses())) {
    for (std::size_t k = 0; k < graph.edges.size(); ++k) {
      const BlockEdge& e = graph.edges[k];
      if (odometry[k]) {
        if (e.j == e.i + 1) step_[static_cast<std::size_t>(e.i)] = e.T_i_j;
        continue;
      }
      const bool up = e.i < e.j;
      closures_.emplace(std::min(e.i, e.j),
                        Closure{k, std::min(e.i, e.j), std::max(e.i, e.j),
                                up ? e.T_i_j : e.T_i_j.inverse(), e.kappa, e.tau});
    }
  }

  [[nodiscard]] std::vector<bool> isolated() const {
    std::vector<bool> isolated(graph_.edges.size(), false);
    for (const auto& [lower, closure] : closures_) {
      const auto begin = closures_.lower_bound(lower - kBeside);
      const auto end = closures_.upper_bound(lower + kBeside);
      isolated[closure.edge] =
          std::none_of(begin, end, [&](const auto& entry) { return agree(closure, entry.second); });
    }
    return isolated;
  }

 private:
  // The pose of `to` in the frame of `from` by odometry; nullopt where it is interrupted.
  [[nodiscard]] std::optional<SE3> chain(Index from, Index to) const {
    if (from > to) {
      const auto back = chain(to, from);
      return back ? std::optional(back->inverse()) : std::nullopt;
    }
    SE3 T = SE3::Identity();
    for (Index i = from; i < to; ++i) {
      const auto& step = step_[static_cast<std::size_t>(i)];
      if (!step) return std::nullopt;
      T = T * *step;
    }
    return T;
  }

  [[nodiscard]] bool agree(const Closure& one, const Closure& other) const {
    if (one.edge == other.edge || std::abs(one.upper - other.upper) > kBeside) return false;
    const auto T_lower = chain(one.lower, other.lower);
    const auto T_upper = chain(other.upper, one.upper);
    if (!T_lower || !T_upper) return false;
    const SE3 T = *T_lower * other.T_lower_upper * *T_upper;
    const SE3& measured = one.T_lower_upper;
    const double turned = one.kappa * (T.linear() - measured.linear()).squaredNorm();
    const double moved = one.tau * (T.translation() - measured.translation()).squaredNorm();
    // Both closures' noise and that of every step; a rotation also moves the far end of a closure.
    const double variances = 2.0 + static_cast<double>(std::abs(one.lower - other.lower) +
                                                       std::abs(one.upper - other.upper));
    const double lever = 1.0 + one.tau / one.kappa * measured.translation().squaredNorm();
    return turned <= barc_ * barc_ * variances && moved <= barc_ * barc_ * variances * lever;
  }

  const TeamGraph& graph_;
  double barc_;
  std::vector<std::optional<SE3>> step_;  // from each pose to the next
  std::multimap<Index, Closure> closures_;
};

}  // namespace

std::vector<bool> isolated_closures(const TeamGraph& graph, const std::vector<bool>& odometry,
                                    double barc) {
  return Corroboration(graph, odometry, barc).isolated();
}

}  // namespace km
