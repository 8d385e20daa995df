#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "modules/place_recognition/descriptor_database.hpp"

namespace km {
namespace {

ImageDescriptor random_descriptor(std::mt19937& rng, std::size_t size = 128) {
  ImageDescriptor descriptor{5, {}};
  for (std::size_t i = 0; i < size; ++i)
    descriptor.values.push_back(static_cast<std::int8_t>(rng()));
  return descriptor;
}

TEST_CASE("The cosine of descriptors is that of their numbers", "[descriptor_database]") {
  const auto of = [](std::vector<std::int8_t> values) {
    return ImageDescriptor{.network = 5, .values = std::move(values)};
  };
  CHECK(cosine(of({3, 4}), of({30, 40})) == Approx(1.0));
  CHECK(cosine(of({3, 4}), of({-3, -4})) == Approx(-1.0));
  CHECK(cosine(of({3, 4}), of({4, 3})) == Approx(0.96));
  CHECK(cosine(of({-128, -128}), of({-128, -128})) == Approx(1.0));
  CHECK(cosine(of({3, 4}), of({3, 4, 0})) == 0.0);
  CHECK(cosine(of({}), of({})) == 0.0);
  CHECK(cosine(of({0, 0}), of({3, 4})) == 0.0);
  CHECK(cosine(of({3, 4}), {.network = 6, .values = {3, 4}}) == 0.0);
}

TEST_CASE("A search finds the images of brute force, in their order", "[descriptor_database]") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  DescriptorDatabase database;
  std::vector<ImageDescriptor> images;
  for (int i = 0; i < 200; ++i) {
    images.push_back(i % 7 == 3 ? ImageDescriptor() : random_descriptor(rng, 4));
    database.add(images.back());
  }
  const ImageDescriptor query = random_descriptor(rng, 4);
  constexpr double kLeast = 0.2;
  constexpr std::size_t kLast = 150;
  std::vector<std::pair<double, std::size_t>> expected;  // negated cosine, index
  for (std::size_t i = 0; i < kLast; ++i)
    if (const double value = cosine(query, images[i]); value >= kLeast)
      expected.emplace_back(-value, i);
  std::ranges::sort(expected);
  const auto matches = database.search(query, kLeast, kLast);
  REQUIRE(matches.size() == expected.size());
  REQUIRE(matches.size() > 10);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    CHECK(matches[i].index == expected[i].second);
    CHECK(matches[i].cosine == -expected[i].first);
  }
  CHECK(database.search({}, -1.0, kLast).empty());
}

}  // namespace
}  // namespace km
