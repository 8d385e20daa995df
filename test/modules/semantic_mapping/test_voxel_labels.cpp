#include "modules/semantic_mapping/voxel_labels.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr unsigned kOne = VoxelLabels::kVotesPerWeight;  // votes of weight 1

TEST_CASE("Four labels are counted exactly, in any order") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> draw(1, 4);
  VoxelLabels labels;
  double counts[5] = {};
  for (int i = 0; i < 60; ++i) {
    const int label = draw(rng);
    counts[label] += 1.0;
    labels.observe(static_cast<LabelId>(label), kOne);
  }
  double most = 0.0;
  for (int label = 1; label <= 4; ++label) {
    CHECK(labels.weight_of(static_cast<LabelId>(label)) == counts[label]);
    most = std::max(most, counts[label]);
  }
  CHECK(counts[labels.best()] == most);
}

TEST_CASE("A label with more than a fifth of the votes is not lost to many others") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> other(2, 200);
  VoxelLabels labels;
  for (int i = 0; i < 90; ++i)
    labels.observe(i % 3 == 0 ? LabelId{1} : static_cast<LabelId>(other(rng)), 1);
  CHECK(labels.best() == 1);
}

TEST_CASE("Old votes fade") {
  VoxelLabels labels;
  for (int i = 0; i < 1000; ++i) labels.observe(1, kOne);
  CHECK(labels.weight_of(1) <= 255.0 / kOne);
  for (int i = 0; i < 40; ++i) labels.observe(2, kOne);
  CHECK(labels.best() == 2);
}

TEST_CASE("Votes of two vertices add up") {
  VoxelLabels a, b;
  a.observe(1, 8);
  a.observe(2, 3);
  b.observe(2, 7);
  b.observe(3, 1);
  a.add(b);
  CHECK(a.best() == 2);
  CHECK(a.weight_of(1) == 8.0 / kOne);
  CHECK(a.weight_of(2) == 10.0 / kOne);
  CHECK(a.weight_of(3) == 1.0 / kOne);
  a.add(VoxelLabels());
  CHECK(a.weight_of(2) == 10.0 / kOne);

  SECTION("beyond the bound both sides fade equally") {
    VoxelLabels full, other;
    for (int i = 0; i < 25; ++i) full.observe(5, 8);   // 200
    for (int i = 0; i < 20; ++i) other.observe(5, 8);  // 160
    for (int i = 0; i < 10; ++i) other.observe(6, 8);  // 80
    full.add(other);
    CHECK(full.weight_of(5) == 180.0 / kOne);
    CHECK(full.weight_of(6) == 40.0 / kOne);
  }
}

}  // namespace
}  // namespace km
