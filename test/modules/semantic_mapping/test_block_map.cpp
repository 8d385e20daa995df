#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <tuple>

#include "modules/semantic_mapping/block_map.hpp"

namespace km {
namespace {

TEST_CASE("The block map holds what a std::map holds", "[semantic_mapping]") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> coordinate(-12, 12);
  std::uniform_int_distribution<int> action(0, 2);
  BlockMap map;
  std::map<std::tuple<int, int, int>, const VoxelBlock*> expected;
  for (int i = 0; i < 20000; ++i) {
    const int x = coordinate(rng), y = coordinate(rng), z = coordinate(rng);
    const Eigen::Vector3i at(x, y, z);
    const auto found = expected.find({x, y, z});
    REQUIRE(map.find(at) == (found == expected.end() ? nullptr : found->second));
    if (found != expected.end() && action(rng) == 0) {
      map.erase(at);
      expected.erase(found);
    } else if (found == expected.end() && action(rng) != 0) {
      expected[{x, y, z}] = &map.insert(at);
    }
    REQUIRE(map.size() == expected.size());
  }
  CHECK(expected.size() > 1000);  // beyond the first table
  for (const auto& [at, block] : expected)
    CHECK(map.find({std::get<0>(at), std::get<1>(at), std::get<2>(at)}) == block);
  for (const auto& block : map.blocks()) CHECK(map.find(block->position) == block.get());
}

TEST_CASE("Blocks beyond the map's reach are not there", "[semantic_mapping]") {
  BlockMap map;
  const int last = BlockMap::kReach - 1;
  map.insert({last, -BlockMap::kReach, 0});
  CHECK(map.find({last, -BlockMap::kReach, 0}) != nullptr);
  CHECK(map.find({last + 1, 0, 0}) == nullptr);
  CHECK(map.find({-BlockMap::kReach - 1, 0, 0}) == nullptr);
}

}  // namespace
}  // namespace km
