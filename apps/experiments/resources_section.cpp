#include <algorithm>
#include <set>

#include "apps/experiments/paper_results.hpp"
#include "apps/experiments/report_sections.hpp"
#include "apps/team/text_table.hpp"

namespace km {
namespace {

constexpr double kBytesPerPixel = 2.0;  // two cameras of one byte, as the paper's numbers have it
constexpr double kMostShare_percent = 38.0, kAimedShare_percent = 10.0;

// Megabytes of one world, the paper's way: one solve of the final graph.
struct Communication {
  double place_recognition = 0.0, verification = 0.0, pgo = 0.0, best_pgo = 0.0, live_pgo = 0.0;
  double images = 0.0, keypoints = 0.0;

  double total() const { return place_recognition + verification + pgo; }
};

const PgoNumbers* pgo_named(ReportInput& input, const WorldConfig& world, const char* name) {
  for (const PgoMethodConfig& method : input.config().methods)
    if (method.name == name) return input.pgo(world, method);
  return nullptr;
}

double megabytes(const PgoNumbers* numbers) {
  return numbers == nullptr ? 0.0 : 1e-6 * numbers->bytes;
}

Communication communication(ReportInput& input, const ReportInput::World& world) {
  const WorldResults& results = *world.results;
  Communication mb;
  mb.place_recognition = results.sent_mb("place_recognition");
  mb.verification = results.sent_mb("geometric_verification");
  mb.live_pgo = results.sent_mb("pgo");
  mb.pgo = megabytes(pgo_named(input, *world.config, "rbcd"));
  mb.best_pgo = megabytes(pgo_named(input, *world.config, "newton"));
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
    const PgoNumbers* const rbcd = pgo_named(input, *world.config, "rbcd");
    const auto cell = [&](double ours, int decimals, auto theirs) {
      return ReportCell{fixed(ours, decimals),
                        paper == nullptr ? std::string() : fixed(theirs(*paper), decimals)};
    };
    const double share = 100.0 * mb.total() / std::max(1e-9, mb.keypoints);
    table.rows.push_back(
        {{world.config->title},
         cell(static_cast<double>(world.results->keyframes()), 0, [](auto& p) { return p.poses; }),
         cell(rbcd == nullptr ? 0.0 : static_cast<double>(rbcd->edges), 0,
              [](auto& p) { return p.edges; }),
         cell(mb.place_recognition, 2, [](auto& p) { return p.place_recognition_mb; }),
         cell(mb.verification, 2, [](auto& p) { return p.verification_mb; }),
         cell(mb.pgo, 2, [](auto& p) { return p.pgo_mb; }),
         cell(mb.total(), 2, [](auto& p) { return p.total_mb; }),
         cell(mb.images, 1, [](auto& p) { return p.images_mb; }),
         cell(mb.keypoints, 2, [](auto& p) { return p.keypoints_mb; }),
         cell(share, 0, [](auto& p) { return 100.0 * p.total_mb / p.keypoints_mb; })});
  }
  table.note =
      "Bytes as serialized, of all robots. PGO: one solve of the final graph by RBCD, as in the "
      "paper. Images: two of one byte per pixel for every keyframe, as the paper's numbers have "
      "it. Keypoints: every keyframe once, with all its keypoints at the 40 bytes that one takes "
      "in our robots' messages (which carry the strongest only).";
  return table;
}

ReportTable live_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "Optimisation: what one solve sends, and what the running team sent [MB]",
      .columns = {"world", "RBCD", "our best (newton)", "during the whole run",
                  "all of the run / keypoints [%]"}};
  for (const auto& world : worlds) {
    const Communication mb = communication(input, world);
    const double all = mb.place_recognition + mb.verification + mb.live_pgo;
    table.rows.push_back({{world.config->title},
                          {fixed(mb.pgo, 2)},
                          {fixed(mb.best_pgo, 2)},
                          {fixed(mb.live_pgo, 2)},
                          {fixed(100.0 * all / std::max(1e-9, mb.keypoints), 0)}});
  }
  table.note = "The running team solves anew whenever a closure is added; the paper's solves once.";
  return table;
}

ReportTable computation_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "Table II: rounds and seconds of optimisation",
                    .groups = {{"", 1},
                               {"RBCD", 2},
                               {"RBCD, 50 rounds", 1},
                               {"centralised", 1},
                               {"our best (newton)", 2}},
                    .columns = {"world", "rounds", "[s]", "[s]", "[s]", "rounds", "[s]"}};
  for (const auto& world : worlds) {
    const PaperWorld* const paper = paper_world(world.config->name);
    std::vector<ReportCell> row{{world.config->title}};
    const auto seconds = [&](const char* name, double theirs) {
      const PgoNumbers* const pgo = pgo_named(input, *world.config, name);
      row.push_back({pgo == nullptr ? "-" : fixed(pgo->seconds, 3),
                     paper == nullptr || theirs == 0.0 ? std::string() : fixed(theirs, 2)});
    };
    const auto rounds = [&](const char* name, int theirs) {
      const PgoNumbers* const pgo = pgo_named(input, *world.config, name);
      row.push_back({pgo == nullptr ? "-" : std::to_string(pgo->rounds),
                     theirs == 0 ? std::string() : std::to_string(theirs)});
    };
    rounds("rbcd", paper == nullptr ? 0 : paper->rbcd_rounds);
    seconds("rbcd", paper == nullptr ? 0.0 : paper->rbcd_s);
    seconds("rbcd50", paper == nullptr ? 0.0 : paper->rbcd50_s);
    seconds("centralized", paper == nullptr ? 0.0 : paper->se_sync_s);
    rounds("newton", 0);
    seconds("newton", 0.0);
    table.rows.push_back(std::move(row));
  }
  table.note =
      "Seconds: processor time of the slowest robot of every round, summed, all in one "
      "process: without what the network adds. A method has finished when its cost is within 1e-6 "
      "of its last; the paper gives the rounds it ran.";
  return table;
}

// Modules whose steps take most of a robot's time; those that only wait for others are left out.
ReportTable profile_table(const std::vector<ReportInput::World>& worlds) {
  constexpr double kLeastShare_percent = 0.5;
  std::map<std::string, double> most;  // percent in the world where it is largest
  const auto share = [](const RobotNumbers& robot, const std::string& module) {
    const auto found = robot.module_s.find(module);
    if (found == robot.module_s.end() || !(robot.recorded_s > 0.0)) return 0.0;
    return 100.0 * found->second / robot.recorded_s;
  };
  const auto mean_share = [&](const WorldResults& results, const std::string& module) {
    double sum = 0.0;
    for (const RobotNumbers& robot : results.robots) sum += share(robot, module);
    return sum / static_cast<double>(std::max<std::size_t>(results.robots.size(), 1));
  };
  for (const auto& world : worlds)
    for (const RobotNumbers& robot : world.results->robots)
      for (const auto& [module, seconds] : robot.module_s)
        most[module] = std::max(most[module], mean_share(*world.results, module));
  std::vector<std::pair<double, std::string>> modules;
  for (const auto& [module, percent] : most)
    if (percent >= kLeastShare_percent) modules.emplace_back(-percent, module);
  std::sort(modules.begin(), modules.end());
  ReportTable table{
      .caption =
          "Where the time goes: steps of each module over the recording [%], mean of the robots",
      .columns = {"module"}};
  for (const auto& world : worlds) table.columns.push_back(world.config->title);
  for (const auto& [percent, module] : modules) {
    std::vector<ReportCell> row{{module}};
    for (const auto& world : worlds) row.push_back({fixed(mean_share(*world.results, module), 1)});
    table.rows.push_back(std::move(row));
  }
  table.note =
      "By the clock on the wall: with three robots on few cores a step also waits for a "
      "core, so these are upper bounds of processor time.";
  return table;
}

ReportTable processor_table(const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "Processor and memory of a whole robot",
      .columns = {"robot", "recording [s]", "CPU time [s]", "cores", "peak memory [MB]"}};
  for (const auto& [config, results] : worlds)
    for (const RobotNumbers& robot : results->robots) {
      if (!robot.processor_s && !robot.peak_memory_mb) continue;
      const bool known = robot.processor_s && robot.recorded_s > 0.0;
      table.rows.push_back({{config->title + ", " + robot.name},
                            {fixed(robot.recorded_s, 0)},
                            {number_text(robot.processor_s, 1)},
                            {known ? fixed(*robot.processor_s / robot.recorded_s, 2) : "-"},
                            {number_text(robot.peak_memory_mb, 0)}});
    }
  return table;
}

void add_targets(ReportInput& input, const ReportInput::World& world) {
  const Communication mb = communication(input, world);
  if (!(mb.keypoints > 0.0)) return;
  const double percent = 100.0 * mb.total() / mb.keypoints;
  input.targets.push_back({"communication over that of centralised keypoints", world.config->title,
                           "at most " + fixed(kMostShare_percent, 0) + " %, aim " +
                               fixed(kAimedShare_percent, 0) + " %",
                           fixed(percent, 0) + " %", percent <= kMostShare_percent});
  for (const RobotNumbers& robot : world.results->robots)
    if (robot.processor_s && robot.recorded_s > 0.0) {
      const double cores = *robot.processor_s / robot.recorded_s;
      input.targets.push_back({"processor of a whole robot",
                               world.config->title + ", " + robot.name, "at most 1 core",
                               fixed(cores, 2) + " cores", cores <= 1.0});
    }
}

}  // namespace

ReportSection resources_section(ReportInput& input) {
  ReportSection section{.id = "resources", .title = "Communication and computation", .blocks = {}};
  const auto worlds = input.worlds(input.config().resources_worlds);
  section.blocks.emplace_back(ReportParagraph{
      "What the robots send to each other, against a centralised system that sends every keyframe "
      "to a base station, as images or as keypoints with descriptors; and what optimisation and "
      "the robots as a whole cost."});
  if (!worlds.empty()) {
    section.blocks.emplace_back(communication_table(input, worlds));
    section.blocks.emplace_back(live_table(input, worlds));
    section.blocks.emplace_back(computation_table(input, worlds));
    if (ReportTable table = processor_table(worlds); !table.rows.empty())
      section.blocks.emplace_back(std::move(table));
    section.blocks.emplace_back(profile_table(worlds));
  }
  for (const auto& world : worlds) add_targets(input, world);
  section.blocks.emplace_back(input.provenance("resources"));
  return section;
}

}  // namespace km
