#include <iostream>
#include <memory>
#include <string>

#include "apps/lab/crowd/commands.hpp"
#include "apps/lab/crowd/crowd_run.hpp"
#include "apps/lab/crowd/crowd_statistics.hpp"
#include "apps/lab/crowd/heap_counter.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "modules/core/text_table.hpp"
#include "modules/place_recognition/packed_bag.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "runtime/dds/status_pace.hpp"

namespace km {
namespace {

using Table = std::vector<std::vector<std::string>>;

struct RecordedInput {
  std::string vocabulary;
  std::vector<std::string> files;

  void define(Command app) {
    app.add_option("vocabulary", vocabulary, "Vocabulary file").required();
    app.add_option("bags", files,
                   "Recorded sequences that revisit their beginning, from kimera_multi_vocabulary "
                   "bags")
        .required();
  }
  [[nodiscard]] std::vector<RecordedPlace> read(const Vocabulary& words) const {
    std::vector<RecordedPlace> places;
    for (const std::string& file : files) places.push_back(read_recorded_place(file, words));
    return places;
  }
};

struct PlacesCommand {
  RecordedInput input;
  CrowdOptions world = {};
  std::vector<std::size_t> robots = {10, 30, 100};
  std::vector<std::size_t> owners = {SketchRouting{}.owners};
  std::vector<std::size_t> sketches = {SketchRouting{}.sketch};
  SketchIndexBounds bounds = {};
  KeyframeIndex window = SketchRouting{}.window;
  std::size_t observed = 2;
  double verified_share = 0.5;
  bool no_everyone = false;
};

void define(Command app, PlacesCommand& command) {
  command.input.define(app);
  CrowdOptions& world = command.world;
  app.add_option("--robots", command.robots, "Sizes of the team").delimiter(',').show_default();
  app.add_option("--keyframes", world.keyframes, "Keyframes of a robot, one every 3 s")
      .show_default();
  app.add_option("--partners", world.partners, "Robots that each robot meets, even").show_default();
  app.add_option("--meetings", world.meetings, "Places that two such robots have in common")
      .show_default();
  app.add_option("--seed", world.seed, "Seed of the runs").show_default();
  app.add_option("--owners", command.owners, "Numbers of words whose owners get a sketch")
      .delimiter(',')
      .show_default();
  app.add_option("--sketch", command.sketches, "Numbers of words of a sketch")
      .delimiter(',')
      .show_default();
  app.add_option("--score", command.bounds.min_score, "Least score of two sketches").show_default();
  app.add_option("--named", command.bounds.max_robots, "Robots that an owner names at most")
      .show_default();
  app.add_option("--window", command.window,
                 "A bag goes to a robot named twice within so many keyframes; 0: named once")
      .show_default();
  app.add_option("--observed", command.observed, "Robots whose searches are simulated")
      .within(1, 1000)
      .show_default();
  app.add_option("--verified", command.verified_share,
                 "Share of the candidates at the same place that are verified")
      .within(0.0, 1.0)
      .show_default();
  app.add_flag("--no-everyone", command.no_everyone, "Simulate owners only");
}

CrowdMeter process_meter() {
  return {.cpu_s = thread_cpu_s, .heap_bytes = counted_heap_bytes};
}

// Sums over the observed robots.
struct Found {
  double robots = 0.0;
  double bags = 0.0, pairs = 0.0, false_pairs = 0.0, keyframes = 0.0, places = 0.0, joined = 0.0;
  double requests = 0.0, false_requests = 0.0, verifications = 0.0;
  double sent = 0.0, received = 0.0;

  explicit Found(const CrowdRun& run) {
    for (const CrowdRobot& robot : run.observed) {
      const CrowdFindings& findings = robot.findings();
      ++robots;
      bags += static_cast<double>(findings.bags);
      pairs += static_cast<double>(findings.true_candidates);
      false_pairs += static_cast<double>(findings.false_candidates);
      places += static_cast<double>(findings.found.size());
      for (const auto& [place, keyframe] : findings.found)
        keyframes += static_cast<double>(keyframe.size());
      joined += static_cast<double>(findings.closures.size());
      requests += static_cast<double>(findings.true_requests);
      false_requests += static_cast<double>(findings.false_requests);
      verifications += static_cast<double>(findings.verifications);
      sent += static_cast<double>(robot.verification_sent().bytes);
      received += static_cast<double>(robot.verification_received().bytes);
    }
  }
  [[nodiscard]] std::string mean(double sum, int decimals = 0) const {
    return fixed(sum / robots, decimals);
  }
};

Table headers() {
  return {{"robots", "method", "messages", "received", "most received", "sent once", "CPU [s]",
           "memory", "stored", "bags", "keyframes found", "places found", "with closure",
           "false pairs", "requests", "false requests", "verified", "verification bytes"}};
}

void add_row(Table& table, std::size_t robots, const std::string& method, const CrowdRun& run) {
  const Found found(run);
  table.push_back(
      {std::to_string(robots), method, std::to_string(run.sent.messages),
       bytes_text(static_cast<double>(run.received.bytes)),
       bytes_text(static_cast<double>(run.most_received)),
       bytes_text(static_cast<double>(run.broadcast)), fixed(run.work.cpu_s, 2),
       bytes_text(run.work.heap_bytes), fixed(run.sketches, 0), found.mean(found.bags),
       found.mean(found.keyframes, 1), found.mean(found.places, 1), found.mean(found.joined, 1),
       found.mean(found.false_pairs), found.mean(found.requests), found.mean(found.false_requests),
       found.mean(found.verifications), bytes_text((found.sent + found.received) / found.robots)});
}

CrowdObservers observers_of(const PlacesCommand& command, std::size_t robots) {
  CrowdObservers observers{.robots = {}, .verified_share = command.verified_share};
  const std::size_t count = std::min(command.observed, robots);
  for (std::size_t i = 0; i < count; ++i)
    observers.robots.push_back(static_cast<RobotId>(i * robots / count));
  return observers;
}

// Bags divided among the owners of their words, and statuses to all robots.
std::vector<std::string> sizes_only(const CrowdWorld& world, const PlaceDisguise& disguise,
                                    const CrowdOptions& options) {
  constexpr std::size_t kSample = 12;         // keyframes of each robot
  constexpr std::size_t kStatusTicks = 7200;  // one hour, every kStatusPeriod_s
  const CrowdTraffic sample = divided_bags(world, disguise, kSample);
  const std::size_t factor = options.keyframes / kSample;
  StatusPace pace;
  CrowdTraffic statuses;
  for (std::size_t tick = 0; tick < kStatusTicks; ++tick)
    if (pace.is_due(0, options.robots - 1)) statuses.add(status_bytes(), options.robots - 1);
  return {std::to_string(options.robots), std::to_string(sample.messages * factor),
          bytes_text(static_cast<double>(sample.bytes * factor)),
          bytes_text(static_cast<double>(statuses.bytes))};
}

void run(const PlacesCommand& command) {
  const Vocabulary vocabulary = load_vocabulary(command.input.vocabulary);
  const std::vector<RecordedPlace> recordings = command.input.read(vocabulary);
  const PlaceDisguise disguise(vocabulary);
  const CrowdMeter meter = process_meter();
  Table table = headers();
  Table sizes{{"robots", "divided bags: messages", "received", "statuses in an hour: received"}};
  for (const std::size_t robots : command.robots) {
    CrowdOptions options = command.world;
    options.robots = robots;
    const CrowdWorld world(recordings, options);
    const CrowdObservers observers = observers_of(command, robots);
    if (!command.no_everyone)
      add_row(table, robots, "everyone",
              send_to_everyone(world, vocabulary, disguise, observers, meter));
    for (const std::size_t owners : command.owners)
      for (const std::size_t sketch : command.sketches) {
        const SketchRouting routing{
            .owners = owners, .sketch = sketch, .bounds = command.bounds, .window = command.window};
        add_row(table, robots,
                std::to_string(owners) + " owners, " + std::to_string(sketch) + " words",
                send_by_owners(world, vocabulary, disguise, observers, routing, meter));
      }
    sizes.push_back(sizes_only(world, disguise, options));
  }
  std::cout << "Of one robot, the mean; bytes as on the network\n"
            << align_columns(table) << '\n'
            << align_columns(sizes);
}

void run_statistics(const RecordedInput& input, std::size_t sketch) {
  const Vocabulary vocabulary = load_vocabulary(input.vocabulary);
  const std::vector<RecordedPlace> recordings = input.read(vocabulary);
  const auto cell = [](const ScoreRange& range) {
    return fixed(range.median, 3) + " / " + fixed(range.largest, 3);
  };
  Table table{{"recording", "keyframes", "words", "bytes", "consecutive", "revisit", "disguised",
               "elsewhere"}};
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const PlaceStatistics statistics = statistics_of(recordings, i, vocabulary, sketch);
    table.push_back({input.files[i], std::to_string(2 * recordings[i].first.size()),
                     fixed(statistics.words, 0), fixed(statistics.bytes, 0),
                     cell(statistics.consecutive), cell(statistics.revisit),
                     cell(statistics.disguised), cell(statistics.elsewhere)});
  }
  std::cout << "Scores: median / largest\n" << align_columns(table);
}

}  // namespace

void add_places(Command parent) {
  const Command app = parent.add_subcommand(
      "places", "Words to everyone, or sketches to the owners of words: costs and places found");
  const auto command = std::make_shared<PlacesCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

void add_statistics(Command parent) {
  const Command app = parent.add_subcommand(
      "statistics", "Similarities inside recordings, and of the places made of them");
  const auto input = std::make_shared<RecordedInput>();
  const auto sketch = std::make_shared<std::size_t>(kMaxBagWords);
  input->define(app);
  app.add_option("--sketch", *sketch, "Use only so many words of a keyframe, the heaviest ones");
  app.callback([input, sketch] { run_statistics(*input, *sketch); });
}

}  // namespace km
