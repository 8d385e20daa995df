#include "modules/view/view_update.hpp"
#include "test/modules/view/some_updates.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> samples() {
  std::vector<Bytes> all;
  for (const ViewContent& content : updates_of_all_kinds()) all.push_back(encode_view(content));
  return all;
}

bool is_understood(const ViewContent& content) {
  return decode_view(encode_view(content)).has_value();
}

TEST_CASE("Texts are encoded in printable ASCII") {
  RobotSample state{.name = "a\nb\xC3\xA9"};
  const auto decoded = decode_view(encode_view(state));
  REQUIRE(decoded);
  CHECK(std::get<RobotSample>(*decoded).name == "a?b??");
}

TEST_CASE("Truncated and extended updates are refused") {
  for (const Bytes& sample : samples()) {
    CAPTURE(int{sample[0]});
    REQUIRE(decode_view(sample));
    for (std::size_t size = 0; size < sample.size(); ++size)
      CHECK_FALSE(decode_view(std::span(sample).first(size)));
    Bytes longer = sample;
    longer.push_back(0);
    CHECK_FALSE(decode_view(longer));
  }
  CHECK_FALSE(decode_view(Bytes{8}));
  CHECK_FALSE(decode_view(Bytes{255, 0, 0}));
}

template <typename T, typename Change>
ViewContent changed(T content, const Change& change) {
  change(content);
  return content;
}

TEST_CASE("Updates with impossible numbers are refused") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<std::pair<const char*, ViewContent>> impossible = {
      {"a cost", RobotSample{.cost = kNan}},
      {"a load", RobotSample{.loads = {{"vio", kNan}}}},
      {"a silence", RobotSample{.links = {{1, kInfinity}}}},
      {"a position",
       changed(ViewPose{}, [](auto& pose) { pose.T_odom_body.translation().y() = kNan; })},
      {"a far position",
       changed(ViewPose{}, [](auto& pose) { pose.T_odom_body.translation().y() = 2e7; })},
      {"a matrix that is no rotation",
       changed(some_keyframes(2),
               [](auto& keyframes) { keyframes.T_world_kf[1].linear() *= 1.1; })},
      {"a feature", changed(some_image(), [](auto& image) { image.features[1][0] = kInfinity; })},
      {"a closure with its ends exchanged", changed(some_closures(),
                                                    [](auto& closures) {
                                                      auto& id = closures.closures[0].id;
                                                      std::swap(id.from, id.to);
                                                    })},
      {"a verdict", changed(some_closures(),
                            [](auto& closures) {
                              closures.closures[0].verdict = static_cast<ClosureStatus>(4);
                            })},
      {"a box of negative size",
       changed(some_objects(), [](auto& objects) { objects.objects[1].size_m.y() = -1.0F; })},
      {"no cells in a run", changed(some_raster(), [](auto& raster) { raster.runs[0] = 0; })},
      {"fewer cells", changed(some_raster(), [](auto& raster) { raster.runs[0] = 2; })},
      {"more cells", changed(some_raster(), [](auto& raster) { raster.runs[0] = 255; })},
      {"another value", changed(some_raster(), [](auto& raster) { raster.runs[1] = 2; })},
      {"a large raster",
       changed(some_raster(),
               [](auto& raster) { raster.width = raster.height = ViewRaster::kMaxSide; })},
      {"a face outside", changed(some_chunk(), [](auto& chunk) { chunk.faces[0][2] = 4; })},
  };
  for (const auto& [what, content] : impossible) {
    CAPTURE(what);
    CHECK_FALSE(is_understood(content));
  }
}

TEST_CASE("The size of an update is bounded") {
  CHECK(is_understood(some_keyframes(2000)));
  CHECK_THROWS_AS(encode_view(some_keyframes(2200)), std::length_error);
  ViewImage image;
  image.jpeg.resize(kMaxViewBytes - 20);
  CHECK(is_understood(image));
  image.jpeg.resize(kMaxViewBytes);
  CHECK_THROWS_AS(encode_view(image), std::length_error);
  Bytes bytes = encode_view(ViewKeyframes{});
  bytes.back() = 0x7F;  // More poses than follow.
  CHECK_FALSE(decode_view(bytes));
}

// Each accepted update equals the result of encoding it again, so it is safe to show.
TEST_CASE("Corrupted updates are refused or decoded consistently") {
  const std::vector<Bytes> good = samples();
  InputCorrupter corrupter(GENERATE(1U, 2U));
  int accepted = 0;
  constexpr int kCount = 20'000;
  for (int k = 0; k < kCount; ++k) {
    const auto content = decode_view(corrupter(good));
    if (!content) continue;
    ++accepted;
    REQUIRE(is_understood(*content));
  }
  CHECK(accepted > 0);
  CHECK(accepted < kCount / 2);
}

}  // namespace
}  // namespace km
