#include <catch2/catch.hpp>

#include "apps/doctor/examine_live.hpp"

namespace km {
namespace {

constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kImu = "sensor_msgs/msg/Imu";

Finding the_finding(const Examination& result) {
  REQUIRE(result.findings.size() == 1);
  return result.findings[0];
}

}  // namespace

TEST_CASE("Live topics that are received are sound", "[doctor]") {
  const std::vector<TopicPublisher> publishers = {{"/left", kImage}, {"/imu", kImu}};
  const auto result =
      examine_topics({{"/left", kImage, 60}, {"/imu", kImu, 600}}, publishers, 3.0, 0);
  CHECK(result.findings.empty());
  CHECK_THAT(to_text(result.figures),
             Catch::Contains("60 messages of sensor_msgs/msg/Image in 3.0"));
}

TEST_CASE("The reason why a live topic is silent follows from the publishers", "[doctor]") {
  using Catch::Contains;
  const std::vector<ListenedTopic> wanted = {{"/left", kImage, 0}};
  const auto why = [&](const std::vector<TopicPublisher>& publishers) {
    return the_finding(examine_topics(wanted, publishers, 3.0, 0));
  };
  CHECK(why({{"/imu", kImu}}).id == "live.silent");
  CHECK_THAT(why({{"/imu", kImu}}).what, Contains("no program publishes it"));
  CHECK_THAT(why({{"/left", kImage}}).what, Contains("although a program publishes it"));
  CHECK(why({{"/left", "sensor_msgs/msg/CompressedImage"}}).id == "live.other_type");
  CHECK(why({{"/cam/left", "sensor_msgs/Image"}}).id == "live.similar_name");
  const auto begins_most_alike = why({{"/cam/left", kImage}, {"/left/image", kImage}});
  CHECK_THAT(begins_most_alike.what, Contains("but /left/image is of that type"));
  CHECK_THAT(why({{"/cam/left", kImage}}).what, Contains("/cam/left is of that type"));
  // A topic that another camera already uses is not proposed.
  const auto result = examine_topics({{"/cam0", kImage, 60}, {"/cam2", kImage, 0}},
                                     {{"/cam0", kImage}, {"/other1", kImage}}, 3.0, 0);
  CHECK_THAT(the_finding(result).what, Contains("but /other1 is of that type"));
}

TEST_CASE("If there is no publisher at all, one finding reports it, whatever topics are missing",
          "[doctor]") {
  const auto result = examine_topics({{"/left", kImage, 0}, {"/imu", kImu, 0}}, {}, 3.0, 7);
  REQUIRE(result.findings.size() == 1);
  CHECK(result.figures.size() == 2);
  CHECK(result.findings[0].id == "live.no_publishers");
  CHECK_THAT(result.findings[0].what, Catch::Contains("domain 7"));
}

}  // namespace km
