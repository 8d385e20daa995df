#include <nlohmann/json.hpp>

#include "apps/viewer/view_store.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

ViewUpdate image(RobotId robot, std::size_t bytes, std::uint64_t boot = 1) {
  return {robot, boot, 0, ViewImage{0, std::vector<std::uint8_t>(bytes), {}}};
}

ViewUpdate chunk(std::int32_t cell, std::size_t faces, std::uint64_t boot = 1) {
  MeshChunk content{.key = {0, {cell, 0, 0}, 0}};
  content.offsets.resize(3);
  content.faces.resize(faces);
  return {0, boot, 0, content};
}

ViewUpdate pose(RobotId robot) {
  return {robot, 1, 0, ViewPose{}};
}

std::vector<std::uint64_t> numbers(const ViewStore::Batch& batch) {
  std::vector<std::uint64_t> found;
  for (const auto& message : batch.messages) {
    const std::string text =
        message->binary ? message->bytes.substr(4, message->bytes.find('}') - 3) : message->bytes;
    found.push_back(nlohmann::json::parse(text)["n"].get<std::uint64_t>());
  }
  return found;
}

using Numbers = std::vector<std::uint64_t>;

TEST_CASE("A page receives everything in order, whenever it opens") {
  ViewStore store(1'000'000);
  for (RobotId robot = 0; robot < 5; ++robot) store.add(pose(robot));
  ViewStore::Cursor early, late;
  CHECK(numbers(store.take(early, 1'000'000, 0.0)) == Numbers{0, 1, 2, 3, 4});
  store.add(pose(7));
  const ViewStore::Batch more = store.take(early, 1'000'000, 0.0);
  CHECK(numbers(more) == Numbers{5});
  CHECK(more.caught_up);
  CHECK(numbers(store.take(late, 1'000'000, 0.0)) == Numbers{0, 1, 2, 3, 4, 5});
}

TEST_CASE("The size of a batch of messages for a page is bounded") {
  ViewStore store(1'000'000);
  for (int i = 0; i < 4; ++i) store.add(image(0, 1000));
  ViewStore::Cursor cursor;
  const ViewStore::Batch first = store.take(cursor, 1500, 0.0);
  CHECK(numbers(first) == Numbers{0, 1});
  CHECK_FALSE(first.caught_up);
  CHECK(numbers(store.take(cursor, 1500, 0.0)) == Numbers{2, 3});
}

TEST_CASE("Beyond the limit images of the past go first, then replaced meshes") {
  ViewStore store(10'000);
  ViewStore::Cursor page;
  store.add(chunk(0, 200));   // 0: replaced by 2
  store.add(image(0, 3000));  // 1: followed by 3
  store.add(chunk(0, 201));   // 2
  store.add(image(0, 3001));  // 3
  CHECK(store.size().forgotten == 0);
  static_cast<void>(store.take(page, 1'000'000, 0.0));
  store.add(image(1, 2000));  // newest image of another robot
  const ViewStore::Batch batch = store.take(page, 1'000'000, 0.0);
  CHECK(batch.forgotten == Numbers{1});
  CHECK(numbers(batch) == Numbers{4});
  store.add(image(2, 2000));  // 5
  CHECK(store.take(page, 1'000'000, 0.0).forgotten == Numbers{0});
  ViewStore::Cursor late;
  const ViewStore::Batch all = store.take(late, 1'000'000, 0.0);
  CHECK(numbers(all) == Numbers{2, 3, 4, 5});
  CHECK(all.forgotten.empty());  // it never had those
}

TEST_CASE("Present states are kept, and new messages without room are refused") {
  ViewStore store(5000);
  store.add(chunk(0, 300));
  store.add(chunk(1, 300));  // replaces nothing
  store.add(chunk(2, 300));
  CHECK(store.size().refused == 1);
  CHECK(store.size().bytes <= 5000);
  store.add(chunk(2, 10));  // takes the room of the refused one
  ViewStore::Cursor page;
  CHECK(numbers(store.take(page, 1'000'000, 0.0)) == Numbers{0, 1, 3});
}

TEST_CASE("Messages of an ended process of a robot no longer count") {
  ViewStore store(5000);
  store.add(chunk(0, 300));
  store.add(chunk(1, 300));
  store.add(chunk(0, 300, 2));  // another process
  CHECK(store.size().refused == 0);
  CHECK(store.size().forgotten == 1);
}

TEST_CASE("A message that is repeated without a change reaches pages once") {
  ViewStore store(1'000'000);
  const auto closures = [](ClosureStatus first, ClosureStatus second) {
    return ViewUpdate{
        0, 1, 0,
        ViewClosures{{{{{0, 1}, {1, 1}}, first, 9, 8, {}}, {{{0, 2}, {1, 2}}, second, 9, 8, {}}}}};
  };
  const auto keyframes = [](double x_m) {
    return ViewUpdate{
        0, 1, 0, ViewKeyframes{true, 0, 0, {make_pose(Eigen::Matrix3d::Identity(), {x_m, 0, 0})}}};
  };
  const auto again = [](ViewUpdate update) {
    update.sent = 5;
    return update;
  };
  using enum ClosureStatus;
  for (const ViewUpdate& update :
       {chunk(0, 10), keyframes(1.0), closures(kVerified, kCandidate), pose(0)}) {
    store.add(update);         // 0 to 3
    store.add(again(update));  // the pose alone: 4
  }
  store.add(chunk(0, 11));                    // 5
  store.add(keyframes(2.0));                  // 6
  store.add(closures(kVerified, kRejected));  // 7: its second
  store.add(chunk(0, 11, 2));                 // from another process
  ViewStore::Cursor page;
  const ViewStore::Batch all = store.take(page, 1'000'000, 0.0);
  CHECK(numbers(all) == Numbers{0, 1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(all.messages[7]->bytes.find("verified") == std::string::npos);
  CHECK(all.messages[7]->bytes.find("rejected") != std::string::npos);
}

TEST_CASE("A raster replaces the former one, and a repetition is ignored") {
  ViewStore store(2500);
  const auto raster = [](std::size_t bytes) {
    return ViewUpdate{0, 1, 0, ViewRaster{.runs = std::vector<std::uint8_t>(bytes)}};
  };
  store.add(raster(1400));  // 0: replaced by 1
  store.add(raster(1400));
  CHECK(store.size().messages == 1);
  store.add(raster(1401));
  ViewStore::Cursor page;
  CHECK(numbers(store.take(page, 1'000'000, 0.0)) == Numbers{1});
}

}  // namespace
}  // namespace km
