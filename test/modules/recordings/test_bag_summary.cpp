#include <catch2/catch.hpp>

#include "modules/recordings/bag_summary.hpp"
#include "test/modules/sensors/listed_bag.hpp"

namespace km {
namespace {

constexpr Stamp kSecond = 1'000'000'000;

std::vector<std::uint8_t> image_at(Stamp stamp) {
  RosImage image;
  image.header.stamp = stamp;
  image.height = 2;
  image.width = 3;
  image.encoding = "mono8";
  return encode_ros(image);
}

TEST_CASE("Topics are summed up by the stamps of their sensors", "[recordings]") {
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

TEST_CASE("Messages in an encoding that is not known are placed by the recorder's clock",
          "[recordings]") {
  ListedBag bag;
  bag.add_bytes(bag.add_channel("/left", RosImage::kType, "json"), 5, {'{'});
  const auto topics = summarise_topics(bag);
  REQUIRE(topics.size() == 1);
  CHECK(topics[0].stamps == std::vector<Stamp>{5});
  CHECK_FALSE(topics[0].is_image);
}

TEST_CASE("Cameras of one rate are compared and others are not", "[recordings]") {
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

}  // namespace
}  // namespace km
