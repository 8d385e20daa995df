#include <catch2/catch.hpp>

#include <memory>

#include "apps/lab/crowd/crowd_run.hpp"
#include "apps/lab/crowd/heap_counter.hpp"
#include "apps/lab/crowd/virtual_network.hpp"
#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/place_recognition/bag_file.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/robot_status.hpp"
#include "test/apps/lab/crowd/synthetic_places.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

template <typename T>
std::size_t content_bytes(const T& message) {
  const auto encoded = Codec<T>::encode(message);
  return serialize(Codec<T>::descriptor(), &encoded.wire).size();
}

TEST_CASE("The sizes of messages are those of the codecs", "[crowd]") {
  // The envelope pads contents to a multiple of 4.
  const auto padded = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
  const BagOfWords bag = synthetic_place(1, 1).first[0];
  const KeyframeBow bow{.id = {7, 8}, .stamp = 9, .vocabulary = 10, .words = bag};
  CHECK(padded(content_bytes(bow)) == padded(bag_bytes(pack(bag).size())));
  CHECK(padded(content_bytes(KeyframeRequest{})) == padded(request_bytes()));
  CHECK(padded(content_bytes(Closure{})) == padded(closure_bytes()));
  const std::string name = GENERATE("anna", "robot_9");
  CHECK(padded(content_bytes(RobotStatus{.robot = 1, .name = name})) == padded(status_bytes()));
  // Words of an image are about 60 apart; the size depends on their gaps.
  KeyframeWords words{.number = 1, .keyframe = {}, .words = {450.0, 0.1, {}}};
  for (std::uint32_t i = 1; i <= 110; ++i)
    words.words.points.push_back({{.bearing = {0.1F, 0.2F}, .inverse_depth = 0.5F}, 60 * i});
  CHECK(static_cast<double>(content_bytes(words)) ==
        Approx(static_cast<double>(words_bytes(110))).epsilon(0.1));
  const std::size_t points = GENERATE(1U, 200U, 600U);
  KeyframeReply reply{.number = 1, .found = true, .keyframe = {}};
  reply.descriptors.resize(points);
  CHECK(padded(content_bytes(reply)) == padded(reply_bytes(points)));
}

// Robots of a small team, and what robot 0 finds.
struct SmallTeam {
  explicit SmallTeam(std::size_t robots)
      : world(recordings, {.robots = robots, .keyframes = 60, .partners = 2, .meetings = 2}) {}

  Vocabulary vocabulary = shipped_vocabulary();
  PlaceDisguise disguise{vocabulary};
  std::vector<RecordedPlace> recordings = {synthetic_place(1, 6), synthetic_place(2, 6)};
  CrowdWorld world;
  CrowdMeter meter = {};
  CrowdObservers observers{.robots = {0}, .verified_share = 1.0};

  [[nodiscard]] CrowdRun everyone() const {
    return send_to_everyone(world, vocabulary, disguise, observers, meter);
  }
  [[nodiscard]] CrowdRun owners() const {
    return send_by_owners(world, vocabulary, disguise, observers, {}, meter);
  }
};

TEST_CASE("Owners find the places that words to everyone find, with fewer messages and bags",
          "[crowd]") {
  const SmallTeam team(20);
  const CrowdRun everyone = team.everyone();
  const CrowdRun owners = team.owners();
  const CrowdFindings& all = everyone.observed.at(0).findings();
  const CrowdFindings& few = owners.observed.at(0).findings();
  REQUIRE(!all.found.empty());
  for (const auto& [place, keyframes] : all.found) CHECK(few.found.contains(place));
  CHECK(few.closures.size() == all.closures.size());
  CHECK(few.bags < all.bags / 4);
  CHECK(owners.received.bytes < everyone.received.bytes / 2);
  CHECK(few.true_candidates > 0);
  CHECK(few.false_candidates <= all.false_candidates);
}

TEST_CASE("With owners, the bytes of a robot do not grow with the team", "[crowd]") {
  const CrowdRun small = SmallTeam(20).owners();
  const CrowdRun large = SmallTeam(80).owners();
  // Six words have N (1 - (1 - 1 / N)^6) different owners. One of N is the robot itself. So there
  // are 5.0 other owners in a team of 20, and 5.7 in one of 80: 1.14 times as many. The rest of the
  // bound is for robots that are named by chance.
  CHECK(static_cast<double>(large.received.bytes) <
        1.5 * static_cast<double>(small.received.bytes));
  CHECK(large.sketches < 1.3 * small.sketches);
  CHECK(SmallTeam(80).everyone().received.bytes > 4 * SmallTeam(20).everyone().received.bytes);
}

TEST_CASE("A message to everyone counts once per reader", "[crowd]") {
  const SmallTeam team(5);
  const CrowdRun run = team.everyone();
  CHECK(run.sent.bytes == 4 * run.broadcast);
  CHECK(run.received.bytes == run.sent.bytes);
  std::size_t bags = 0;
  for (std::size_t robot = 1; robot < 5; ++robot) bags += team.world.places(robot).size();
  CHECK(run.observed.at(0).findings().bags == bags);
}

TEST_CASE("The heap counter counts what is allocated and not released", "[crowd]") {
  const double before = counted_heap_bytes();
  auto kept = std::make_unique<std::vector<char>>(100000);
  const double more = counted_heap_bytes() - before;
  kept.reset();
  // malloc rounds each of two allocations up, by less than 100 bytes.
  CHECK(more >= 100000);
  CHECK(more < 100200);
  CHECK(counted_heap_bytes() == before);
}

TEST_CASE("The program simulates a small team", "[crowd]") {
  const TemporaryFolder folder;
  const RecordedPlace place = synthetic_place(3, 4);
  std::vector<BagOfWords> bags = place.first;
  bags.insert(bags.end(), place.second.begin(), place.second.end());
  const auto file = folder.write("bags.txt", bags_text(bags));
  const std::string tool = KM_BIN_DIR "/kimera_multi_crowd ";
  const std::string input = "config/vocabulary/indoor.kmvoc " + file.string();
  const CommandResult places = run_command(
      tool + "places " + input + " --robots 5,6 --partners 2 --keyframes 40 --observed 1");
  CHECK(places.exit_code == 0);
  CHECK_THAT(places.output, Catch::Contains("everyone") && Catch::Contains("6 owners, 100 words") &&
                                Catch::Contains("statuses in an hour"));
  const CommandResult statistics = run_command(tool + "statistics " + input);
  CHECK(statistics.exit_code == 0);
  CHECK_THAT(statistics.output, Catch::Contains("consecutive"));
  const CommandResult back_end =
      run_command(tool + "back-end --robots 5 --keyframes 300 --partners 2 --closures 8");
  CHECK(back_end.exit_code == 0);
  CHECK_THAT(back_end.output, Catch::Contains("joined"));
  const CommandResult refused = run_command(tool + "places " + input + " --robots 4");
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.output, Catch::Contains("number of partners"));
}

}  // namespace
}  // namespace km
