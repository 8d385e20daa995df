#include "modules/sensors/node/sensors_node.hpp"

#include <optional>
#include <sstream>
#include <utility>

#include "modules/core/io/text_table.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kReadAhead = 8;  // packets decoded ahead of the published one

void log_lines(const std::string& text, std::string_view name) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) log::warn(name) << line;
}

}  // namespace

SensorsNode::SensorsNode(const SensorsConfig& config, const PlaybackPace& pace,
                         std::unique_ptr<DatasetReader> reader, const SensorsTopics& topics)
    : WorkerNode({.name = "sensors", .queue = kReadAhead}),
      reader_(std::move(reader)),
      listed_(reader_->pair_count()),
      is_live_(reader_->is_live()),
      leaves_out_(is_live_ || !pace.waits),
      shedding_(checked(config).max_lag_s),
      clock_(pace.rate),
      topics_(topics) {
  topics_.processed.subscribe([this](const auto& frame) {
    const std::lock_guard lock(shedding_mutex_);
    shedding_.finish(*frame);
  });
}

void SensorsNode::start_sources() {
  // A failure of the decoder reaches the worker behind the packets that were decoded before it.
  decoder_.start(
      "decoder", [this] { decode(); }, [this] { post(std::current_exception()); });
}

void SensorsNode::stop_sources() noexcept {
  stopped_ = true;
  reader_->stop();
  clock_.stop();
  if (!decoder_.joinable()) return;
  decoder_.join();
  take_faults();
}

void SensorsNode::decode() {
  bool has_remarked = false;
  while (!stopped_) {
    auto packet = [this] {
      const Heartbeat::Step step(decoding_);
      const auto scope = reading_.measure();
      return reader_->next(
          [this](Stamp stamp, Stamp arrival) { return choose_use(stamp, arrival); });
    }();
    if (!std::exchange(has_remarked, true))
      for (const std::string& remark : reader_->remarks()) log::info(name()) << remark;
    if (packet) note_doubts(*packet);
    count_faults();
    if (!packet) {
      post(reader_->report());
      return;
    }
    if (!post(std::make_shared<const SensorPacket>(std::move(*packet)))) return;
  }
}

void SensorsNode::note_doubts(const SensorPacket& packet) {
  std::vector<Doubt> doubts = first_.add(packet, reader_->rig().stereo.cameras[0]);
  if (!std::exchange(has_looked_, true)) {
    const std::vector<Doubt> of_rig = rig_doubts(reader_->rig().stereo);
    doubts.insert(doubts.end(), of_rig.begin(), of_rig.end());
  }
  for (const Doubt& doubt : doubts)
    log::warn(name()) << doubt.what << ": " << doubt.means << "; " << doubt.to_do;
  const std::lock_guard lock(faults_mutex_);
  doubts_.insert(doubts_.end(), doubts.begin(), doubts.end());
}

void SensorsNode::count_faults() {
  constexpr double kInterval_s = 5.0;
  const double now_s = steady_now_s();
  if (now_s - counted_s_ < kInterval_s) return;
  counted_s_ = now_s;
  take_faults();
}

// Also logs new faults of a live source, because it has no end at which to log them.
void SensorsNode::take_faults() {
  const ReaderReport report = reader_->report();
  {
    const std::lock_guard lock(faults_mutex_);
    faults_ = report;
  }
  if (!reader_->is_live()) return;
  const std::string faults = to_string(report);
  if (faults != logged_faults_) log_lines(faults, name());
  logged_faults_ = faults;
}

FrameUse SensorsNode::choose_use(Stamp stamp, Stamp arrival) {
  if (is_live_) return choose_use(stamp, 1e-9 * static_cast<double>(arrival), wall_now_s());
  const std::optional<double> due_s = clock_.due_s(stamp);
  if (!due_s) return FrameUse::kAll;
  const double now_s = steady_now_s();
  const double paused_s = wait_for_odometry(*due_s, now_s);
  return leaves_out_ ? choose_use(stamp, *due_s + paused_s, now_s) : FrameUse::kAll;
}

// Pauses the clock of the recording if the image that is due at `due_s`, or odometry, is late.
// Returns the pause [s].
double SensorsNode::wait_for_odometry(double due_s, double now_s) {
  const std::lock_guard lock(shedding_mutex_);
  const double pause_s = shedding_.pause_s(due_s, now_s);
  if (pause_s <= 0.0) return 0.0;
  clock_.pause(pause_s);
  shedding_.pause(pause_s);
  paused_s_ += pause_s;
  log::limited(leaves_out_ ? log::Level::kWarn : log::Level::kInfo, name(), "pause")
      << "the processor is too slow: the recording has waited for " << fixed(paused_s_, 1)
      << " s in total";
  return pause_s;
}

FrameUse SensorsNode::choose_use(Stamp stamp, double due_s, double now_s) {
  std::unique_lock lock(shedding_mutex_);
  const ShedLoad before = shedding_.load();
  const FrameUse use = shedding_.use_next(stamp, due_s, now_s);
  const ShedLoad now = shedding_.load();
  lock.unlock();
  if (now != before) report_load(before, now);
  if (use == FrameUse::kNone) ++skipped_;
  return use;
}

void SensorsNode::report_load(const ShedLoad& before, const ShedLoad& now) {
  topics_.load.publish(now);
  const bool is_more = now.stride > before.stride || (now.map && !before.map);
  auto line = log::limited(is_more ? log::Level::kWarn : log::Level::kInfo, name(),
                           is_more ? "shed" : "restored");
  const bool is_over = now == ShedLoad{};
  line << (is_more   ? "the processor is too slow: "
           : is_over ? "the processor keeps up again: "
                     : "the processor is less busy: ");
  if (now.stride > 1)
    line << (now.map && !before.map ? "the map gets no new frames, " : "")
         << "odometry gets one of " << now.stride << " images";
  else if (before.stride > 1)
    line << "odometry gets every image";
  else
    line << (now.map ? "the map gets no new frames" : "the map gets new frames");
}

void SensorsNode::step(const Topic<SensorPacket>::Message& packet) {
  const bool is_due = [&] {
    if (is_live_) return !stopped_;
    const Heartbeat::Waiting waiting;
    return clock_.wait_until(packet->frame->stamp);
  }();
  if (!is_due) return;
  topics_.packets.publish(packet);
  ++published_;
}

void SensorsNode::step(const ReaderReport& faults) {
  if (stopped_) return;
  log_lines(to_string(faults), name());
  log::info(name()) << "end of data: " << published_ << " frames, " << skipped_ << " skipped";
  topics_.end({published_, skipped_, paused_s(), faults});
}

}  // namespace km
