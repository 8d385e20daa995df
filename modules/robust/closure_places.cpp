#include "modules/robust/closure_places.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

namespace km {
namespace {

constexpr std::size_t kMostRivals = 500;
constexpr double kAgree_rad = 0.1, kAgree_m = 0.5, kNoRival_m = 1.0, kByDistance = 0.02;

bool agree(const AlignedOdometry& x, const AlignedOdometry& y, double bound_m) {
  return (x.T_a_b * y.p_b - y.T_a_b * y.p_b).norm() <=
             bound_m + kByDistance * (x.p_b - y.p_b).norm() &&
         angle_of(x.T_a_b.linear().transpose() * y.T_a_b.linear()) <= kAgree_rad;
}

// An even selection of the closures that are kept, or of the others.
std::vector<AlignedOdometry> select(std::span<const AlignedOdometry> all,
                                    std::span<const ClosureId> kept, bool are_kept) {
  std::vector<AlignedOdometry> found;
  std::ranges::copy_if(all, std::back_inserter(found), [&](const AlignedOdometry& x) {
    return std::ranges::binary_search(kept, x.closure) == are_kept;
  });
  const std::size_t stride = 1 + found.size() / (kMostRivals + 1);
  std::vector<AlignedOdometry> selected;
  for (std::size_t k = 0; k < found.size(); k += stride) selected.push_back(found[k]);
  return selected;
}

bool are_near(const KeyframeId& a, const KeyframeId& b) {
  return a.robot == b.robot && steps_between(a, b) <= kNearSteps;
}

}  // namespace

RobotId first_robot(std::span<const PoseEdge> closures) {
  if (closures.empty()) return 0;
  const auto [lower, upper] = std::minmax(closures.front().from.robot, closures.front().to.robot);
  std::uint64_t on_lower = 0, on_upper = 0;
  for (const PoseEdge& e : closures) {
    on_lower += e.end_on(lower).index;
    on_upper += e.end_on(upper).index;
  }
  return on_upper < on_lower ? upper : lower;
}

ClosureOrder order_of(std::span<const PoseEdge> closures) {
  const RobotId first = first_robot(closures);
  ClosureOrder order;
  for (std::size_t k = 0; k < closures.size(); ++k) {
    const ClosureId id = closures[k].id();
    order.emplace_back(id.from.robot == first ? id : ClosureId{id.to, id.from}, k);
  }
  std::ranges::sort(order);
  return order;
}

std::vector<double> ClosureGroups::weights() const {
  std::vector<double> weights;
  for (const std::size_t group : group_of)
    weights.push_back(1.0 / static_cast<double>(sizes[group]));
  return weights;
}

std::vector<double> ClosureGroups::votes() const {
  std::vector<double> votes = weights();
  for (double& vote : votes) vote = std::min(1.0, kVotesOfPlace * vote);
  return votes;
}

ClosureGroups find_rows(std::span<const PoseEdge> closures) {
  const ClosureOrder order = order_of(closures);
  std::vector<std::size_t> parent(order.size());  // the first closure of a row is its own parent
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto first_of = [&](std::size_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  for (std::size_t k = 0; k < order.size(); ++k)
    for (std::size_t p = k; p-- > 0 && are_near(order[p].first.from, order[k].first.from);)
      if (are_near(order[p].first.to, order[k].first.to)) {
        const auto [lower, upper] = std::minmax({first_of(p), first_of(k)});
        parent[upper] = lower;
      }
  ClosureGroups rows{.group_of = std::vector<std::size_t>(closures.size())};
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t first = first_of(k);
    if (first == k) rows.sizes.push_back(0);
    const std::size_t row = first == k ? rows.sizes.size() - 1 : rows.group_of[order[first].second];
    rows.group_of[order[k].second] = row;
    ++rows.sizes[row];
  }
  return rows;
}

ClosureGroups find_places(std::span<const PoseEdge> closures) {
  ClosureGroups places{.group_of = std::vector<std::size_t>(closures.size())};
  std::vector<ClosureId> first_of;  // first closure of each place
  for (const auto& [id, k] : order_of(closures)) {
    // Only places that begin a little before this closure can contain it.
    std::size_t place = first_of.size();
    for (std::size_t p = first_of.size(); p-- > 0 && are_near(first_of[p].from, id.from);)
      if (are_near(first_of[p].to, id.to)) place = p;
    if (place == first_of.size()) {
      first_of.push_back(id);
      places.sizes.push_back(0);
    }
    ++places.sizes[place];
    places.group_of[k] = place;
  }
  return places;
}

AlignedOdometry align_odometry(const Closure& closure) {
  const bool is_forward = closure.from.id < closure.to.id;
  const OdometryPose &a = is_forward ? closure.from : closure.to,
                     &b = is_forward ? closure.to : closure.from;
  const SE3 T_ka_kb = is_forward ? closure.T_from_to : closure.T_from_to.inverse();
  return {closure.id(), a.T_odom_kf * T_ka_kb * b.T_odom_kf.inverse(), b.T_odom_kf.translation()};
}

std::size_t count_rival_rows(std::span<const AlignedOdometry> all,
                             std::span<const ClosureId> kept) {
  const std::vector<AlignedOdometry> confirmed = select(all, kept, true);
  std::vector<std::vector<AlignedOdometry>> groups;  // each agrees with its first closure
  for (const AlignedOdometry& x : select(all, kept, false)) {
    if (std::ranges::any_of(confirmed, [&](const auto& y) { return agree(x, y, kNoRival_m); }))
      continue;
    const auto group = std::ranges::find_if(
        groups, [&](const auto& members) { return agree(members.front(), x, kAgree_m); });
    (group == groups.end() ? groups.emplace_back() : *group).push_back(x);
  }
  std::size_t rows = 0;
  for (const std::vector<AlignedOdometry>& group : groups) {
    std::vector<PoseEdge> closures;
    closures.reserve(group.size());
    for (const AlignedOdometry& x : group)
      closures.push_back({.from = x.closure.from, .to = x.closure.to});
    if (const std::size_t count = find_rows(closures).sizes.size(); count > 1) rows += count;
  }
  return rows;
}

}  // namespace km
