#include "modules/recordings/bag_summary.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kSecond = 1'000'000'000;

std::vector<std::uint8_t> image_at(Stamp stamp) {
  return encode_ros(mono_image({stamp, "camera"}, 3, 2));
}

TEST_CASE("Topics are summed up by the stamps of their sensors") {
  ListedBag bag;
  const auto image = bag.describe("/left", RosImage::kType);
  const auto text = bag.describe("/text", "std_msgs/String");
  const auto again = bag.add_channel("/left", RosImage::kType, "cdr");  // a restarted publisher
  bag.add_bytes(image, 100 * kSecond, image_at(7 * kSecond + 5));
  bag.add_bytes(text, 101 * kSecond, {1, 2});
  bag.add_bytes(again, 102 * kSecond, image_at(8 * kSecond + 5));
  bag.add_bytes(image, 103 * kSecond, {0});  // not an image
  const auto topics = summarise_topics(bag);
  REQUIRE(topics.size() == 2);
  CHECK(topics[0].topic == "/left");
  CHECK(topics[0].has_sensor_stamps);
  CHECK(topics[0].stamps == std::vector<Stamp>{7 * kSecond + 5, 8 * kSecond + 5});
  CHECK(topics[0].undecoded == 1);
  REQUIRE(topics[0].image);
  CHECK(topics[0].image->size == ImageSize{3, 2});
  CHECK(topics[0].image->encoding == "mono8");
  CHECK_FALSE(topics[1].has_sensor_stamps);
  CHECK_FALSE(topics[1].is_image);
  CHECK(topics[1].stamps == std::vector<Stamp>{101 * kSecond});
}

TEST_CASE("Messages in an encoding that is not known are placed by the recorder's clock") {
  ListedBag bag;
  bag.add_bytes(bag.add_channel("/left", RosImage::kType, "json"), 5, {'{'});
  const auto topics = summarise_topics(bag);
  REQUIRE(topics.size() == 1);
  CHECK(topics[0].stamps == std::vector<Stamp>{5});
  CHECK_FALSE(topics[0].is_image);
}

TEST_CASE("Cameras of one rate are compared and others are not") {
  ListedBag bag;
  for (Stamp stamp = 0; stamp < 10 * kSecond; stamp += kSecond) {
    bag.add_bytes("/left", RosImage::kType, stamp, image_at(stamp));
    bag.add_bytes("/right", RosImage::kType, stamp, image_at(stamp + 2'000'000));
    if (stamp % (2 * kSecond) == 0) bag.add_bytes("/slow", RosImage::kType, stamp, image_at(stamp));
  }
  const auto pairs = pairs_of_images(summarise_topics(bag));
  REQUIRE(pairs.size() == 1);
  CHECK(pairs[0].first == "/left");
  CHECK(pairs[0].second == "/right");
  CHECK(pairs[0].agreement.pairs == 10);
  CHECK(pairs[0].agreement.median_offset_s == Approx(0.002));
}

constexpr Stamp kMs = 1'000'000;

TEST_CASE("Rate and gaps of stamps are those of their intervals") {
  // Intervals of 10 ms, one of 50 and one of 12.
  std::vector<Stamp> stamps;
  for (int i = 0; i < 100; ++i)
    stamps.push_back(1'000'000'000 + (i * 10 + (i > 50 ? 40 : 0)) * kMs);
  stamps.back() += 2 * kMs;
  const StampStatistics statistics = stamp_statistics(stamps);
  CHECK(statistics.count == 100);
  CHECK(statistics.first == 1'000'000'000);
  CHECK(statistics.last == 1'000'000'000 + 1032 * kMs);
  CHECK(statistics.rate_hz == Approx(99 / 1.032));
  CHECK(statistics.largest_gap_s == Approx(0.05));
  CHECK(statistics.jitter_s == Approx(0.0).margin(1e-12));
  CHECK(statistics.unordered == 0);
}

TEST_CASE("Jitter bounds the deviation of 19 of 20 intervals") {
  // Deviations from the median of 1, 2, ..., 21 ms are 0, then 1 to 10 twice: of 21 the 20th is 10.
  std::vector<Stamp> stamps = {0};
  for (int i = 1; i <= 21; ++i) stamps.push_back(stamps.back() + i * kMs);
  CHECK(stamp_statistics(stamps).jitter_s == Approx(0.010));
}

TEST_CASE("Too few stamps have no rate") {
  CHECK(stamp_statistics({}).count == 0);
  CHECK(std::isnan(stamp_statistics({}).rate_hz));
  const StampStatistics one = stamp_statistics({5});
  CHECK(one.first == 5);
  CHECK(std::isnan(one.rate_hz));
  CHECK(std::isnan(one.largest_gap_s));
  CHECK(std::isnan(stamp_statistics({5, 5}).rate_hz));
  const Stamp most = std::numeric_limits<Stamp>::max();
  CHECK(stamp_statistics({-most, most}).largest_gap_s == Approx(2.0 * 9223372036.854775807));
}

TEST_CASE("Stamps of two cameras that are one agree") {
  std::vector<Stamp> first, second;
  for (int i = 0; i < 20; ++i) {
    first.push_back(i * 50 * kMs);
    second.push_back(i * 50 * kMs + (i == 7 ? 3 : 2) * kMs);
  }
  first.erase(first.begin() + 3);
  second.pop_back();
  const StampAgreement agreement = stamp_agreement(first, second, 0.025);
  CHECK(agreement.pairs == 18);
  CHECK(agreement.only_first == 1);
  CHECK(agreement.only_second == 1);
  CHECK(agreement.equal == 0);
  CHECK(agreement.median_offset_s == Approx(0.002));
  CHECK(agreement.largest_deviation_s == Approx(0.001));
  CHECK(stamp_agreement(second, first, 0.025).median_offset_s == Approx(-0.002));
  CHECK(stamp_agreement(first, first, 0.025).equal == 19);
}

}  // namespace
}  // namespace km
