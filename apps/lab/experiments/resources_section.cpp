#include <algorithm>
#include <cmath>

#include "apps/lab/experiments/paper_results.hpp"
#include "apps/lab/experiments/processor_tables.hpp"
#include "apps/lab/experiments/report.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr double kBytesPerPixel =
    2.0;  // two cameras with one byte per pixel, as in the paper's numbers
constexpr double kAimedShare_percent = 10.0;

// Megabytes of one world, counted as in the paper: one solve of the final graph.
struct Communication {
  double place_recognition = 0.0, verification = 0.0, pgo = 0.0, newton_pgo = 0.0, live_pgo = 0.0;
  double images = 0.0, keypoints = 0.0;
  double all_sent = 0.0;  // in the whole run, except for the map
  double equal_keypoints = 0.0;

  double total() const { return place_recognition + verification + pgo; }
  double whole_run() const { return place_recognition + verification + live_pgo; }
  double of_keypoints_percent(double sent) const {
    return keypoints > 0.0 ? 100.0 * sent / keypoints : NAN;
  }
  double of_equal_keypoints_percent() const {
    return equal_keypoints > 0.0 ? 100.0 * all_sent / equal_keypoints : NAN;
  }
};

double megabytes(const PgoNumbers& numbers) {
  return 1e-6 * numbers.bytes;
}

Communication communication(ReportInput& input, const ReportInput::World& world) {
  const WorldResults& results = *world.results;
  Communication mb;
  mb.place_recognition = results.sent_mb("place_recognition");
  mb.verification = results.sent_mb("geometric_verification");
  mb.live_pgo = results.sent_mb("pgo");
  mb.all_sent = results.counted_mb();
  mb.equal_keypoints = results.equal_keypoints_mb();
  mb.pgo = of_method(input, world, "rbcd", megabytes);
  mb.newton_pgo = of_method(input, world, "newton", megabytes);
  mb.images =
      1e-6 * kBytesPerPixel * static_cast<double>(results.image_pixels * results.keyframes());
  for (const RobotNumbers& robot : results.robots)
    mb.keypoints +=
        1e-6 * robot.keyframe_bytes.value_or(0.0) * static_cast<double>(robot.keyframes);
  return mb;
}

ReportTable communication_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "Table II: communication [MB]",
                    .groups = {{"", 3}, {"distributed", 4}, {"centralised", 2}, {"", 1}},
                    .columns = {"world", "poses", "edges", "place recognition", "verification",
                                "PGO (RBCD)", "total", "images", "keypoints", "of keypoints [%]"}};
  for (const auto& world : worlds) {
    const PaperWorld* const paper = paper_world(world.config->name);
    const Communication mb = communication(input, world);
    const auto cell = [&](double ours, int decimals, auto theirs) {
      return ReportCell{fixed(ours, decimals), paper == nullptr
                                                   ? std::string()
                                                   : fixed(theirs(paper->resources), decimals)};
    };
    table.rows.push_back(
        {{world.config->title},
         cell(static_cast<double>(world.results->keyframes()), 0, [](auto& p) { return p.poses; }),
         cell(of_method(input, world, "rbcd", [](auto& pgo) { return pgo.edges; }), 0,
              [](auto& p) { return p.edges; }),
         cell(mb.place_recognition, 2, [](auto& p) { return p.place_recognition_mb; }),
         cell(mb.verification, 2, [](auto& p) { return p.verification_mb; }),
         cell(mb.pgo, 2, [](auto& p) { return p.pgo_mb; }),
         cell(mb.total(), 2, [](auto& p) { return p.total_mb; }),
         cell(mb.images, 1, [](auto& p) { return p.images_mb; }),
         cell(mb.keypoints, 2, [](auto& p) { return p.keypoints_mb; }),
         cell(mb.of_keypoints_percent(mb.total()), 0,
              [](auto& p) { return 100.0 * p.total_mb / p.keypoints_mb; })});
  }
  table.note =
      "Bytes as serialized, of all robots. PGO: one solve of the final graph by RBCD, as in the "
      "paper. Images: two of one byte per pixel for every keyframe, as the paper's numbers have "
      "it. Keypoints: every keyframe once, with all its keypoints at 40 bytes: 8 of position and "
      "32 of descriptor. Our robots send the strongest keypoints only: 6 bytes of position and "
      "word, and 12 of descriptor if the positions agree.";
  return table;
}

ReportTable live_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "Optimisation: what one solve sends, and what the running team sent [MB]",
      .columns = {"world", "RBCD", "Newton, the default", "during the whole run",
                  "all of the run / keypoints [%]", "all of the run, other bytes included",
                  "these / as many keypoints [%]"}};
  for (const auto& world : worlds) {
    const Communication mb = communication(input, world);
    table.rows.push_back({{world.config->title},
                          {fixed(mb.pgo, 2)},
                          {fixed(mb.newton_pgo, 2)},
                          {fixed(mb.live_pgo, 2)},
                          {fixed(mb.of_keypoints_percent(mb.whole_run()), 0)},
                          {fixed(mb.all_sent, 2)},
                          {fixed(mb.of_equal_keypoints_percent(), 0)}});
  }
  table.note =
      "The running team solves again as closures come; the paper's solves once. Other bytes: "
      "statuses and messages for robots out of reach, but no meshes and objects. The last share is "
      "that of a server that receives each keyframe with as many keypoints as the robots receive "
      "of a keyframe in the mean.";
  return table;
}

ReportTable computation_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "Table II: rounds and seconds of optimisation",
                    .groups = {{"", 1},
                               {"RBCD", 2},
                               {"RBCD, 50 rounds", 1},
                               {"centralised", 1},
                               {"Newton, the default", 2}},
                    .columns = {"world", "rounds", "[s]", "[s]", "[s]", "rounds", "[s]"}};
  for (const auto& world : worlds) {
    const PaperWorld* const paper = paper_world(world.config->name);
    const PaperResources theirs = paper == nullptr ? PaperResources{} : paper->resources;
    const auto rounds = [&](const char* method, int of_paper) {
      return ReportCell{
          fixed(of_method(input, world, method, [](auto& pgo) { return pgo.rounds; }), 0),
          of_paper == 0 ? std::string() : std::to_string(of_paper)};
    };
    const auto seconds = [&](const char* method, double of_paper) {
      return ReportCell{
          fixed(of_method(input, world, method, [](auto& pgo) { return pgo.seconds; }), 3),
          of_paper == 0.0 ? std::string() : fixed(of_paper, 2)};
    };
    table.rows.push_back({{world.config->title},
                          rounds("rbcd", theirs.rbcd_rounds),
                          seconds("rbcd", theirs.rbcd_s),
                          seconds("rbcd50", theirs.rbcd50_s),
                          seconds("centralized", theirs.se_sync_s),
                          rounds("newton", 0),
                          seconds("newton", 0.0)});
  }
  table.note =
      "Seconds: processor time of the slowest robot of every exchange, summed, all in one "
      "process: without what the network adds. A method has finished when its cost is within 1e-6 "
      "of its last; the paper gives the rounds it ran.";
  return table;
}

std::vector<Communication> of_all_runs(ReportInput& input, const ReportInput::World& world) {
  std::vector<Communication> runs;
  for (const auto& run : input.runs_of(*world.config)) runs.push_back(communication(input, run));
  return runs;
}

// Worlds whose team was run more than once.
ReportTable resource_spread_table(ReportInput& input,
                                  const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "How much runs differ: median, and lowest to highest [MB]",
      .columns = {"world", "runs", "place recognition", "verification", "all solves of the run",
                  "one solve by RBCD", "total, one solve / keypoints [%]"}};
  for (const auto& world : worlds) {
    const std::vector<Communication> runs = of_all_runs(input, world);
    if (runs.size() < 2) continue;
    const auto cell = [&](const auto& value, int decimals) {
      return spread_cell(spread_over(runs, value), decimals);
    };
    table.rows.push_back({{world.config->title},
                          {std::to_string(runs.size())},
                          cell([](auto& mb) { return mb.place_recognition; }, 2),
                          cell([](auto& mb) { return mb.verification; }, 2),
                          cell([](auto& mb) { return mb.live_pgo; }, 2),
                          cell([](auto& mb) { return mb.pgo; }, 2),
                          cell([](auto& mb) { return mb.of_keypoints_percent(mb.total()); }, 1)});
  }
  return table;
}

// The paper counts one solve. The bytes that the team actually sent have the same target.
void add_targets(ReportInput& input, const ReportInput::World& world) {
  const std::vector<Communication> runs = of_all_runs(input, world);
  const std::string most = "at most " + fixed(kPaperMostShare_percent, 0) + " %";
  const std::string aim = most + ", aim " + fixed(kAimedShare_percent, 0) + " %";
  const auto add = [&](const char* what, const std::string& wanted, const auto& share_percent) {
    const Spread percent = spread_over(runs, share_percent);
    if (percent.count == 0) return;
    input.add_target({std::string("communication over ") + what, world.config->title, wanted,
                      fixed(percent.median, 0) + " %" + range_text(percent, 0),
                      percent.median <= kPaperMostShare_percent, true});
  };
  add("all keypoints sent, one solve, as the paper counts", aim,
      [](const Communication& mb) { return mb.of_keypoints_percent(mb.total()); });
  add("all keypoints sent, all solves of the run", most,
      [](const Communication& mb) { return mb.of_keypoints_percent(mb.whole_run()); });
  add("as many keypoints as robots receive, all of the run", aim,
      [](const Communication& mb) { return mb.of_equal_keypoints_percent(); });
}

}  // namespace

std::optional<ReportSection> resources_section(ReportInput& input) {
  const auto worlds = input.worlds(input.config().resources_worlds);
  const std::optional<RobotNumbers> alone = input.alone();
  if (worlds.empty() && !alone) return std::nullopt;
  ReportSection section{.id = "resources", .title = "Communication and computation"};
  section.add(ReportParagraph{
      "What the robots send to each other, against a centralised system that sends every keyframe "
      "to a base station, as images or as keypoints with descriptors; and what optimisation and "
      "the robots as a whole cost."});
  if (!worlds.empty()) {
    section.add(communication_table(input, worlds));
    section.add(live_table(input, worlds));
    section.add(resource_spread_table(input, worlds));
    section.add(computation_table(input, worlds));
  }
  for (const auto& world : worlds) add_targets(input, world);
  add_processor_tables(input, worlds, alone, section);
  return section;
}

}  // namespace km
