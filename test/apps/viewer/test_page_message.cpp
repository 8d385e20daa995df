#include <nlohmann/json.hpp>

#include "apps/viewer/page_message.hpp"
#include "test/modules/view/some_updates.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using nlohmann::json;

json text_of(const ViewUpdate& update) {
  const PageMessage message = page_message(update, 42);
  REQUIRE_FALSE(message.binary);
  return json::parse(message.bytes);
}

// The object of a binary message, and the data behind it.
std::pair<json, std::string> parts_of(const PageMessage& message) {
  REQUIRE(message.binary);
  std::uint32_t length = 0;
  std::memcpy(&length, message.bytes.data(), 4);
  CHECK((4 + length) % 4 == 0);
  return {json::parse(message.bytes.substr(4, length)), message.bytes.substr(4 + length)};
}

TEST_CASE("A state is sent with its members' names") {
  RobotSample state;
  state.name =
      "ro\xff"
      "bot";
  state.phase = "running";
  state.keyframes = 7;
  state.tentative = true;
  state.links = {{3, 1.25F}};
  state.sent_bytes = {{"pgo", 1234.0}};
  const json message = text_of({5, 0xfedcba9876543210U, 1'500'000'000, state});
  CHECK(message["n"] == 42);
  CHECK(message["t"] == 1500.0);
  CHECK(message["robot"] == 5);
  CHECK(message["boot"] == "fedcba9876543210");  // JSON's numbers end at 2^53
  CHECK(message["kind"] == "state");
  CHECK(message["name"] ==
        "ro\xEF\xBF\xBD"
        "bot");  // invalid UTF-8 is replaced and not fatal
  CHECK(message["keyframes"] == 7);
  CHECK(message["tentative"] == true);
  CHECK(message["links"] == json::parse("[[3, 1.25]]"));
  CHECK(message["sent_bytes"] == json::parse(R"({"pgo": 1234.0})"));
}

TEST_CASE("A mesh is sent as its arrays, one after the other") {
  MeshChunk chunk{.key = {3, {-1, 0, 7}, 2}, .anchor = 1};
  chunk.offsets = {{1, 2, 3}, {4, 5, 6}, {7, 8, 65535}};
  chunk.labels = {9, 8, 7};
  chunk.colors = {0xF800, 0x07E0, 0x001F};
  chunk.faces = {{0, 1, 2}};
  const auto [object, data] = parts_of(page_message({3, 1, 0, chunk}, 1));
  CHECK(object["cell"] == json::parse("[-1, 0, 7]"));
  CHECK(object["vertices"] == 3);
  CHECK(object["faces"] == 1);
  CHECK(object["anchor"] == 1);
  std::array<std::uint16_t, 15> numbers{};
  REQUIRE(data.size() == sizeof(numbers) + 3);
  std::memcpy(numbers.data(), data.data(), sizeof(numbers));
  CHECK(numbers == std::array<std::uint16_t, 15>{1, 2, 3, 4, 5, 6, 7, 8, 65535, 0, 1, 2, 0xF800,
                                                 0x07E0, 0x001F});
  CHECK(data.substr(sizeof(numbers)) == "\x09\x08\x07");
  CHECK_FALSE(object.contains("team"));  // a chunk of another robot is of the mesh of the team
  CHECK(parts_of(page_message({2, 1, 0, chunk}, 1)).first["team"] == true);
}

// The page shows every member of an update.
TEST_CASE("Updates of every kind are the same for the page after encoding and decoding") {
  for (const ViewContent& content : updates_of_all_kinds()) {
    const PageMessage sent = page_message({0, 1, 0, content}, 1);
    CAPTURE(sent.bytes);
    const auto received = decode_view(encode_view(content));
    REQUIRE(received);
    CHECK(page_message({0, 1, 0, *received}, 1).bytes == sent.bytes);
  }
}

TEST_CASE("Poses, closures and objects are lists of numbers") {
  const Eigen::Quaterniond turn(0.8, 0.0, 0.0, 0.6);
  const json poses = text_of(
      {0, 1, 0, ViewKeyframes{true, 2, 9, {make_pose(turn.toRotationMatrix(), {1.00004, 2, -3})}}});
  CHECK(poses["optimized"] == true);
  CHECK(poses["anchor"] == 2);
  CHECK(poses["first"] == 9);
  CHECK(poses["T_world_kf"] == json::parse("[[1, 2, -3, 0, 0, 0.6, 0.8]]"));
  const ViewClosure closure{closure_id({1, 2}, {0, 4}), ClosureStatus::kRejected, 30, 8, "too far"};
  CHECK(text_of({0, 1, 0, ViewClosures{{closure}}})["closures"] ==
        json::parse(R"([[0, 4, 1, 2, "rejected", 30, 8, "too far"]])"));
  const ViewObjects objects{
      .anchor = 2, .objects = {{7, {1, -2, 0.5F}, 0.25F, {2, 1, 1.5F}, {0, 3}}}, .left_out = 4};
  const json message = text_of({0, 1, 0, objects});
  CHECK(message["left_out"] == 4);
  CHECK(message["objects"] == json::parse("[[7, [1, -2, 0.5], 0.25, [2, 1, 1.5], [0, 3]]]"));
}

TEST_CASE("A raster is sent as its runs, an image after its features") {
  const ViewRaster raster{.origin = {1, 2, 3}, .width = 5, .runs = {5, 31}};
  const auto [object, data] = parts_of(page_message({0, 1, 0, raster}, 1));
  CHECK(object["layer"] == "map_2d");
  CHECK(object["origin"] == json::parse("[1, 2, 3]"));
  CHECK(object["width"] == 5);
  CHECK(data == "\x05\x1f");
  const ViewImage image{0, {0xff, 0xd8}, {{1.5F, 2.5F}}};
  const auto [head, bytes] = parts_of(page_message({0, 1, 0, image}, 1));
  CHECK(head["features"] == 1);
  CHECK(bytes.size() == 8 + 2);
  CHECK(bytes.substr(8) == "\xff\xd8");
}

}  // namespace
}  // namespace km
