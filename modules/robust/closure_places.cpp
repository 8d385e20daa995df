#include "modules/robust/closure_places.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "modules/core/geometry.hpp"

namespace km {
namespace {

constexpr KeyframeIndex kExtent = 10;  // keyframes of a place, at both ends

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
  return a.robot == b.robot && steps_between(a, b) <= kExtent;
}

}  // namespace

std::vector<double> ClosurePlaces::weights() const {
  std::vector<double> weights;
  for (const std::size_t place : place_of)
    weights.push_back(1.0 / static_cast<double>(sizes[place]));
  return weights;
}

ClosurePlaces find_places(std::span<const PoseEdge> closures) {
  std::vector<std::pair<ClosureId, std::size_t>> order;
  for (std::size_t k = 0; k < closures.size(); ++k) order.emplace_back(closures[k].id(), k);
  std::ranges::sort(order);
  ClosurePlaces places{.place_of = std::vector<std::size_t>(closures.size())};
  std::vector<ClosureId> first_of;  // first closure of each place
  for (const auto& [id, k] : order) {
    // Only places that begin a little before this closure can contain it.
    std::size_t place = first_of.size();
    for (std::size_t p = first_of.size(); p-- > 0 && are_near(first_of[p].from, id.from);)
      if (are_near(first_of[p].to, id.to)) place = p;
    if (place == first_of.size()) {
      first_of.push_back(id);
      places.sizes.push_back(0);
    }
    ++places.sizes[place];
    places.place_of[k] = place;
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

std::size_t count_rival_places(std::span<const AlignedOdometry> all,
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
  std::size_t places = 0;
  for (const std::vector<AlignedOdometry>& group : groups) {
    std::vector<PoseEdge> closures;
    closures.reserve(group.size());
    for (const AlignedOdometry& x : group)
      closures.push_back({.from = x.closure.from, .to = x.closure.to});
    if (const std::size_t count = find_places(closures).sizes.size(); count > 1) places += count;
  }
  return places;
}

}  // namespace km
