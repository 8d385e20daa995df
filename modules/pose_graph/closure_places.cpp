#include "modules/pose_graph/closure_places.hpp"

#include <algorithm>
#include <utility>

namespace km {
namespace {

constexpr KeyframeIndex kExtent = 10;  // keyframes of a place, at both ends

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

}  // namespace km
