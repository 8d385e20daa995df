#include <catch2/catch.hpp>

#include <deque>

#include "modules/core/bytes.hpp"
#include "modules/recordings/bag_summary.hpp"

namespace km {
namespace {

constexpr Stamp kSecond = 1'000'000'000;

// Messages that were never in a file.
class CannedBag final : public BagReader {
 public:
  std::size_t add(const std::string& topic, const std::string& type,
                  const std::string& encoding = "ros1") {
    channels_.push_back({.topic = topic, .type = type, .encoding = encoding});
    return channels_.size() - 1;
  }
  void put(std::size_t channel, Stamp log_time, std::vector<std::uint8_t> bytes) {
    messages_.push_back({channel, log_time, std::move(bytes)});
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override {
    if (messages_.empty()) return std::nullopt;
    BagMessage message = messages_.front();
    messages_.pop_front();
    return message;
  }
  [[nodiscard]] BagReport report() const override { return {}; }

 private:
  std::vector<BagChannel> channels_;
  std::deque<BagMessage> messages_;
};

// An image of ROS 1 with a stamp of whole seconds.
std::vector<std::uint8_t> canned_image(std::uint32_t seconds, std::uint32_t nanoseconds) {
  ByteWriter out;
  out.u32(0);
  out.u32(seconds);
  out.u32(nanoseconds);
  out.u32(0);
  out.u32(2);  // height
  out.u32(3);  // width
  out.u32(5);
  for (const char c : std::string("mono8")) out.u8(static_cast<std::uint8_t>(c));
  out.u8(0);
  out.u32(3);
  out.u32(6);
  for (std::uint8_t k = 0; k < 6; ++k) out.u8(k);
  return out.release();
}

TEST_CASE("Topics are summed up by the stamps of their sensors", "[recordings]") {
  CannedBag bag;
  const auto image = bag.add("/left", "sensor_msgs/Image");
  const auto text = bag.add("/text", "std_msgs/String");
  const auto again = bag.add("/left", "sensor_msgs/Image");  // its publisher was started again
  bag.put(image, 100 * kSecond, canned_image(7, 5));
  bag.put(text, 101 * kSecond, {1, 2});
  bag.put(again, 102 * kSecond, canned_image(8, 5));
  bag.put(image, 103 * kSecond, {0});  // not an image
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
  CannedBag bag;
  bag.put(bag.add("/left", "sensor_msgs/Image", "json"), 5, {'{'});
  const auto topics = summarise_topics(bag);
  REQUIRE(topics.size() == 1);
  CHECK(topics[0].stamps == std::vector<Stamp>{5});
  CHECK_FALSE(topics[0].is_image);
}

TEST_CASE("Cameras of one rate are compared and others are not", "[recordings]") {
  CannedBag bag;
  const auto left = bag.add("/left", "sensor_msgs/Image");
  const auto right = bag.add("/right", "sensor_msgs/Image");
  const auto slow = bag.add("/slow", "sensor_msgs/Image");
  for (std::uint32_t i = 0; i < 10; ++i) {
    bag.put(left, i * kSecond, canned_image(i, 0));
    bag.put(right, i * kSecond, canned_image(i, 2'000'000));
    if (i % 2 == 0) bag.put(slow, i * kSecond, canned_image(i, 0));
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
