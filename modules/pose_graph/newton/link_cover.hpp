#pragma once

#include <compare>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Two poses of different robots that an edge joins; a < b.
struct PublicLink {
  KeyframeId a;
  KeyframeId b;
  auto operator<=>(const PublicLink&) const = default;
};

/// Public poses such that each link has one of them at an end: without them no robot is coupled to
/// another. Ascending, and the same for the same links in whatever order. Greedy vertex cover: the
/// pose with most links left comes next, the smaller one among equals; in the end those are left
/// out that turned out to be superfluous. O(links log links).
[[nodiscard]] std::vector<KeyframeId> cover_links(std::span<const PublicLink> links);

}  // namespace km
