#include <atomic>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "apps/program_options.hpp"
#include "apps/publish/message_player.hpp"
#include "modules/absolute_fixes/fix_reader.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/signal_watch.hpp"

namespace km {
namespace {

constexpr const char* kAbout =
    "Plays a recording as live topics of ROS 2, without ROS, in place of the drivers of a "
    "robot.";

constexpr const char* kFooter = R"(
RECORDING is a bag of ROS 1 (.bag) or ROS 2 (folder, .db3, .mcap), whose topics keep their names, or a
EuRoC/ASL folder: /cam0/image_raw, /cam1/image_raw (or /depth0/image_raw) and /imu0.

Examples
  A robot on live topics, on one host; the rig file names the topics:
    kimera_multi_publish MH_01_easy --wait 1
    kimera_multi_robot --robot 0 --live rig.yaml --output results/a
  Seconds 10 to 40 of it:
    kimera_multi_publish MH_01_easy --wait 1 --from 10 --to 40
  With the fixes of a receiver:
    kimera_multi_publish MH_01_easy --wait 1 --fixes fixes.csv --fix-topic /fix
  The same with a bad driver: up to 20 ms late, one message in ten lost:
    kimera_multi_publish recording.bag --jitter 0.02 --drop 0.1

Exit codes: 0 done, also after Ctrl-C; 1 bad input, or too few readers; 2 bad command line.)";

struct Options {
  std::filesystem::path recording;
  RosConfig ros;
  PlayOptions play;
  std::size_t wait = 0;
  double patience_s = 300.0;
  std::filesystem::path fixes;
  std::string fix_topic = "/fix", fix_type = kGnssType;
};

Options options_of(int argc, char** argv) {
  Options options;
  CLI::App app(kAbout, "kimera_multi_publish");
  app.footer(kFooter);
  app.add_option("RECORDING", options.recording)->required();
  app.add_option("--rate", options.play.rate, "Speed: 1 real time, 2 twice as fast")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  app.add_option("--from", options.play.from_s,
                 "Start of the part to play [s since the first message]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--to", options.play.to_s, "End of the part to play [s since the first message]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--topics", options.play.topics, "Topics to play; by default all")->delimiter(',');
  app.add_option("--wait", options.wait,
                 "Number of readers of each topic of images and inertial samples to wait for "
                 "before playing")
      ->capture_default_str();
  app.add_option("--patience", options.patience_s,
                 "Longest wait for these readers [s]; then the program ends")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--fixes", options.fixes,
                 "File of absolute fixes to play on a topic of their own: rows of a stamp and "
                 "latitude, longitude [deg], altitude [m], or x, y, z [m]; stamps in ns in a .csv "
                 "file, in s elsewhere");
  app.add_option("--fix-topic", options.fix_topic, "Topic of --fixes")->capture_default_str();
  app.add_option("--fix-type", options.fix_type, "Message type of --fixes")
      ->check(CLI::IsMember({kGnssType, kMotionCaptureType}))
      ->capture_default_str();
  app.add_flag("--reliable", options.play.reliable,
               "Send lost messages again; otherwise best effort, as drivers of sensors do");
  app.add_option("--jitter", options.play.jitter_s,
                 "Random delay of each message, uniform from 0 to this [s]")
      ->check(CLI::Range(0., 60.));
  app.add_option("--drop", options.play.drop_share, "Share of messages that are lost, at random")
      ->check(CLI::Range(0., 1.));
  app.add_option("--seed", options.play.seed, "Seed of the random numbers")->capture_default_str();
  const char* const domain = std::getenv("ROS_DOMAIN_ID");
  options.ros.domain = domain != nullptr ? std::atoi(domain) : 0;
  app.add_option(
         "--domain", options.ros.domain,
         "ROS_DOMAIN_ID, by default that of the environment. A robot receives it with --set "
         "ros.domain=N (--domain of a robot is the domain of the team)")
      ->check(CLI::Range(0, 230))
      ->capture_default_str();
  app.add_option("--interface", options.ros.interface, "Network interface, e.g. lo");
  app.add_option("--peers", options.ros.peers, "Addresses of other hosts, where multicast is off")
      ->delimiter(',');
  app.callback([&options] {
    if (!(options.play.from_s < options.play.to_s))
      throw CLI::ValidationError("--from is not before --to");
  });
  if (const auto exit_code = parse_options(app, argc, argv)) std::exit(*exit_code);
  return options;
}

std::unique_ptr<BagReader> open_recording(const std::filesystem::path& recording) {
  if (may_be_bag(recording)) return open_bag(recording);
  if (const FolderLayout layout = layout_of(recording); layout != FolderLayout::kEuroc)
    throw InputFileError(recording.string() + ": " + to_string(layout) +
                         ": only bags and folders in EuRoC's layout can be played");
  const std::filesystem::path mav0 = find_mav0(recording);
  const bool has_depth = std::filesystem::is_directory(mav0 / "depth0");
  return euroc_messages(
      std::make_unique<FolderReader>(open_folder(recording, {.depth = has_depth})));
}

std::unique_ptr<BagReader> open(const Options& options) {
  std::unique_ptr<BagReader> recording = open_recording(options.recording);
  if (options.fixes.empty()) return recording;
  FixRows rows = read_fix_rows(options.fixes);
  if (rows.fixes.empty())
    throw InputFileError(options.fixes.string() + ": no row has a stamp and three coordinates");
  if (rows.malformed > 0)
    log::warn("publish") << options.fixes.string() << ": " << rows.malformed
                         << " rows without a stamp and three coordinates are left out";
  return with_fixes(std::move(recording), std::move(rows.fixes), options.fix_topic,
                    options.fix_type);
}

std::string table(const std::vector<PlayedTopic>& topics) {
  std::vector<std::vector<std::string>> rows = {
      {"topic", "type", "published", "dropped", "not of the type"}};
  for (const PlayedTopic& topic : topics)
    rows.push_back({topic.topic, topic.type, std::to_string(topic.published),
                    std::to_string(topic.dropped), std::to_string(topic.refused)});
  return align_columns(rows);
}

// Times the reports on the progress: is_due() is true once every few seconds.
class Progress {
 public:
  [[nodiscard]] bool is_due() {
    constexpr double kInterval_s = 5.0;
    if (steady_now_s() - reported_s_ < kInterval_s) return false;
    reported_s_ = steady_now_s();
    return true;
  }

 private:
  double reported_s_ = steady_now_s();
};

// True once there are enough readers and they had time to discover the topics; false after a
// signal. Throws after the patience.
bool wait_for_readers(const MessagePlayer& player, const Options& options, SignalWatch& signals) {
  Progress progress;
  const double end_s = steady_now_s() + options.patience_s;
  while (true) {
    const std::vector<std::string> topics = player.topics_short_of(options.wait);
    if (topics.empty()) return !signals.wait(0.3);
    std::string names;
    for (const std::string& topic : topics) names += (names.empty() ? "" : ", ") + topic;
    names +=
        ": " + std::to_string(options.wait) + " of each (--topics plays only those that are read)";
    if (steady_now_s() > end_s)
      throw std::runtime_error("after " + fixed(options.patience_s, 0) +
                               " s still too few readers on ROS domain " +
                               std::to_string(options.ros.domain) + " of " + names);
    if (progress.is_due()) log::info("publish") << "waiting for readers of " << names;
    if (signals.wait(0.05)) return false;
  }
}

void play(const Options& options, SignalWatch& signals) {
  const auto network = std::make_shared<const RosNetwork>(options.ros);
  MessagePlayer player(open(options), network, options.play);
  for (const std::string& topic : player.unsupported_topics())
    log::warn("publish") << "left out, its type is not known: " << topic;
  if (player.topics().empty()) throw std::invalid_argument("there is no topic to play");
  if (!wait_for_readers(player, options, signals)) return;
  std::atomic<bool> ended = false;
  std::jthread stopper([&] {
    while (!ended && !signals.wait(0.2)) {
    }
    player.stop();
  });
  Progress progress;
  while (player.step())
    if (progress.is_due()) log::info("publish") << fixed(player.played_s(), 1) << " s played";
  ended = true;
  std::cout << table(player.topics());
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  const km::Options options = km::options_of(argc, argv);
  km::SignalWatch signals;  // before any thread: threads inherit the blocked signals
  km::play(options, signals);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_publish: " << error.what() << '\n';
  return km::kBadInput;
}
