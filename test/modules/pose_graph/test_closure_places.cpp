#include <catch2/catch.hpp>
#include <vector>

#include "modules/pose_graph/closure_places.hpp"

namespace km {
namespace {

PoseEdge closure(KeyframeId from, KeyframeId to) {
  return {.from = from, .to = to};
}

TEST_CASE("Closures within ten keyframes at both ends form one place", "[closure_places]") {
  const std::vector<PoseEdge> closures{closure({0, 100}, {1, 200}), closure({0, 110}, {1, 190}),
                                       closure({0, 111}, {1, 200}), closure({0, 100}, {1, 211}),
                                       closure({0, 105}, {2, 200}), closure({0, 100}, {0, 200})};
  const ClosurePlaces places = find_places(closures);
  CHECK(places.place_of[0] == places.place_of[1]);
  CHECK(places.sizes.size() == 5);
  for (std::size_t k = 2; k < closures.size(); ++k) CHECK(places.sizes[places.place_of[k]] == 1);
  CHECK(places.weights() == std::vector<double>{0.5, 0.5, 1.0, 1.0, 1.0, 1.0});
}

TEST_CASE("Places do not depend on the order or the direction of closures", "[closure_places]") {
  std::vector<PoseEdge> closures;
  for (KeyframeIndex k = 0; k < 30; ++k)  // a run: three places of 11, 11 and 8 keyframes
    closures.push_back(k % 2 == 0 ? closure({0, 50 + k}, {1, 80 - k})
                                  : closure({1, 80 - k}, {0, 50 + k}));
  const ClosurePlaces upwards = find_places(closures);
  CHECK(upwards.sizes == std::vector<std::size_t>{11, 11, 8});
  const std::vector<PoseEdge> reversed(closures.rbegin(), closures.rend());
  const ClosurePlaces downwards = find_places(reversed);
  for (std::size_t k = 0; k < closures.size(); ++k)
    CHECK(upwards.place_of[k] == downwards.place_of[closures.size() - 1 - k]);
}

TEST_CASE("Without closures there is no place", "[closure_places]") {
  CHECK(find_places({}).sizes.empty());
  CHECK(find_places({}).weights().empty());
}

}  // namespace
}  // namespace km
