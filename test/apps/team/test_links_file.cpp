#include "apps/team/links_file.hpp"

#include "test/support/corrupted_input.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A team of three and a folder for its files of links.
struct LinkedTeam {
  TemporaryFolder folder;
  TeamPlan plan;

  LinkedTeam() {
    for (const char* name : {"a", "b", "c"}) {
      RobotPlan robot;
      robot.name = name;
      plan.robots.push_back(robot);
    }
  }
  fs::path write(const std::string& text) const { return folder.write("links.yaml", text); }
  LinkScript script(const std::string& text) const { return read_links_file(write(text), plan); }
  std::string problems(const std::string& text) const {
    try {
      static_cast<void>(script(text));
    } catch (const std::exception& error) {
      return error.what();
    }
    return {};
  }
};

// Capacity of a second and delay, at the time.
std::pair<double, double> trace(const LinkPlan& link, double time_s) {
  return {link.trace.capacity_until(time_s + 1.0) - link.trace.capacity_until(time_s),
          link.trace.delay_s(time_s)};
}

}  // namespace

TEST_CASE("Keys of a pair override keys of all links") {
  LinkScript script = LinkedTeam().script(
      "seed: 7\nloss: 0.1\ndelay_s: 0.02\njitter_s: 0.01\nrate_bytes_per_s: 1000\n"
      "queue_bytes: 5000\noutages:\n  - {from_s: 1, to_s: 2}\n"
      "pairs:\n"
      "  - {from: a, to: b, loss: 0.5, outages: [{from_s: 8}]}\n"
      "  - {from: b, to: a, one_way: true, rate_bytes_per_s: 99}\n");
  CHECK(script.seed == 7);
  CHECK(script.link(0, 1).loss == 0.5);
  CHECK(script.link(1, 0).loss == 0.5);
  CHECK(script.link(0, 2).loss == 0.1);
  CHECK(trace(script.link(0, 1), 3.0) == std::pair(1000.0, 0.02));
  CHECK(trace(script.link(1, 0), 3.0) == std::pair(99.0, 0.02));
  CHECK(script.link(1, 0).jitter_s == 0.01);
  CHECK(script.link(1, 0).queue_bytes == 5000.0);
  REQUIRE(script.link(1, 0).outages.size() == 2);
  CHECK(script.link(1, 0).outages[0].to_s == 2.0);
  CHECK(script.link(1, 0).outages[1].from_s == 8.0);
  CHECK(script.link(1, 0).outages[1].to_s == kInfinite);
  CHECK(script.link(2, 0).outages.size() == 1);
}

TEST_CASE("A trace takes the place of rate and delay, and they of it") {
  const LinkedTeam team;
  team.folder.write("radio.csv", "0,100,0.5\n10,300,0.7\n");
  LinkScript script = team.script(
      "trace: radio.csv\ndelay_s: 0.1\npairs:\n  - {from: a, to: b, rate_bytes_per_s: 50}\n");
  CHECK(trace(script.link(0, 2), 20.0) == std::pair(300.0, 0.7));
  CHECK(trace(script.link(0, 1), 20.0) == std::pair(50.0, 0.1));
  team.folder.write("radio.csv", "0,100,0.5\n10,300\n");
  CHECK_THAT(team.problems("trace: radio.csv\n"), Contains("radio.csv:2: 2 fields"));
}

TEST_CASE("A recording takes the place of the rate, and the rate of a pair takes its place") {
  const LinkedTeam team;
  const fs::path up = team.folder.write("radio.up", "10\n20\n");
  LinkScript script = team.script(
      "packets: radio.up\ndelay_s: 0.1\npairs:\n  - {from: a, to: b, rate_bytes_per_s: 50}\n");
  REQUIRE(script.link(0, 2).packets);
  CHECK(script.link(0, 2).packets->capacity_until(0.02) == 3000.0);
  CHECK(script.link(0, 2).trace.delay_s(0.0) == 0.1);
  CHECK_FALSE(script.link(0, 1).packets);

  CHECK_THROWS_WITH(read_links_file(up, team.plan), Contains("radio.down"));
  team.folder.write("radio.down", "10\n10\n20\n");
  LinkScript recorded = read_links_file(up, team.plan);
  for (const auto& [from, to] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
    CHECK(recorded.link(from, to).packets->capacity_until(0.02) == 3000.0);
    CHECK(recorded.link(to, from).packets->capacity_until(0.02) == 4500.0);
  }
}

TEST_CASE("Robots that no group of a partition names are a group") {
  const LinkScript script = LinkedTeam().script(
      "partitions:\n  - {from_s: 3, to_s: 4, groups: [[b]]}\n  - {from_s: 9, groups: [[a, c], "
      "[b]]}\n");
  REQUIRE(script.partitions.size() == 2);
  const auto& [when, groups] = script.partitions[0];
  CHECK(when.from_s == 3.0);
  CHECK(when.to_s == 4.0);
  CHECK(groups[0] == groups[2]);
  CHECK(groups[0] != groups[1]);
  CHECK(script.partitions[1].when.to_s == kInfinite);
  CHECK(script.partitions[1].group_of[0] == script.partitions[1].group_of[2]);
  CHECK(script.partitions[1].group_of[0] != script.partitions[1].group_of[1]);
}

TEST_CASE("Range follows the true poses at the time of the recordings") {
  LinkedTeam team;
  for (RobotPlan& robot : team.plan.robots)
    robot.truth = team.folder.write(robot.name + ".tum", "100 0 0 0 0 0 0 1\n110 8 0 0 0 0 0 1\n");
  team.plan.rate = "2.0";
  const LinkScript script = team.script("range_m: 5\n");
  REQUIRE(script.paths.size() == 3);
  REQUIRE(script.paths[1].size() == 2);
  CHECK(script.paths[1][0].time_s == 0.0);
  CHECK(script.paths[1][1].time_s == 10.0);
  CHECK(script.rate == 2.0);
  CHECK(script.paths[1][1].p_world == Eigen::Vector3d(8.0, 0.0, 0.0));
  team.plan.rate = "auto";
  CHECK(team.script("range_m: 5\n").rate == 1.0);
  team.plan.rate = "max";
  CHECK_THAT(team.problems("range_m: 5\n"),
             Contains("links.yaml: range_m") && Contains("--rate that is not max"));
  team.plan.robots[2].truth.clear();
  CHECK_THAT(team.problems("range_m: 5\n"), Contains("range_m needs"));
  team.plan.rate = "1";
  CHECK_THAT(team.problems("pairs:\n  - {from: a, to: b, range_m: 5}\n"),
             Contains("links.yaml: range_m needs the true poses of c"));
}

TEST_CASE("Every problem of a file of links is reported with its line") {
  const std::string problems = LinkedTeam().problems(
      "loss: 1.5\n"
      "latency: 3\n"
      "trace: none.csv\n"
      "outages:\n"
      "  - {from_s: 5, to_s: 5}\n"
      "pairs:\n"
      "  - {from: a, to: d}\n"
      "  - {from: b, to: b}\n"
      "  - {to: c, delay_s: slow}\n"
      "partitions:\n"
      "  - {groups: [[a, e]]}\n"
      "  - {groups: [[a], [b, a]]}\n"
      "  - {from_s: 3}\n");
  for (const char* expected :
       {":1: loss = 1.5 is outside 0 .. 1", ":2: unknown key latency",
        ":3: trace = none.csv is no file or folder: ", ":5: outages.to_s = 5 is not after from_s",
        ":7: pairs name d, which is no robot of the team", ":8: pairs.to = b is the same robot",
        ":9: pairs.from is missing", ":9: pairs.delay_s = slow is not a number",
        ":11: partitions name e, which is no robot of the team", ":12: partitions name a twice",
        ":13: partitions.groups is missing"}) {
    CAPTURE(expected);
    CHECK_THAT(problems, Contains(expected));
  }
}

TEST_CASE("A corrupted file of links is refused by name, or makes a script") {
  const LinkedTeam team;
  check_corrupted<ConfigError>(
      "seed: 3\nloss: 0.1\nrate_bytes_per_s: 1000\nqueue_bytes: 5000\noutages:\n"
      "  - {from_s: 1, to_s: 2}\npairs:\n  - {from: a, to: b, loss: 0.5}\n"
      "partitions:\n  - {from_s: 9, groups: [[a, c], [b]]}\n",
      "links.yaml", [&](const std::string& text) {
        const LinkEmulator emulator(team.script(text));
        CHECK(emulator.robots() == 3);
      });
}

TEST_CASE("The files of links that are shipped can be read") {
  LinkedTeam team;
  for (RobotPlan& robot : team.plan.robots)
    robot.truth = team.folder.write("truth.tum", "0 0 0 0 0 0 0 1\n");
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator("config/links")) {
    CAPTURE(entry.path().string());
    CHECK_NOTHROW(LinkEmulator(read_links_file(entry.path(), team.plan)));
    ++files;
  }
  CHECK(files >= 3);
}

}  // namespace km
