#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "modules/core/camera/frame.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/sensors_config.hpp"
#include "modules/sensors/usual_numbers.hpp"
#include "runtime/clock.hpp"
#include "runtime/guarded_thread.hpp"
#include "runtime/metrics.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// End of the recording.
struct SensorsEnd {
  std::size_t published = 0;  ///< Number of published packets.
  std::size_t skipped = 0;    ///< Number of frames not used because processors were too slow.
  double paused_s = 0.0;      ///< Total pause of the clock because processors were too slow.
  ReaderReport faults;        ///< Faults of the recording.
};

/// Channels of the sensors node; they must outlive it.
struct SensorsTopics {
  /// Frames that odometry has processed, one message per packet.
  In<ProcessedFrame> processed;
  Out<SensorPacket> packets;
  Out<ShedLoad> load;  ///< Each change of the shed load, before the packets that it concerns.
  /// Called once after the last packet, unless stop() comes first.
  std::function<void(const SensorsEnd&)> end;
};

/// A packet, the end of the recording with its faults, or a failure of the decoder.
using SensorsInput = std::variant<Topic<SensorPacket>::Message, ReaderReport, std::exception_ptr>;

/// Plays a recording, or publishes live measurements. One thread decodes ahead. Another thread
/// publishes each packet when it is due; a live packet is due at once. A consumer with a full queue
/// (kBlock) delays publication. For live sensors, and at a PlaybackPace that does not wait,
/// LoadShedding chooses which frames are decoded. The inertial samples of all frames are kept.
class SensorsNode final : public WorkerNode<SensorsInput> {
 public:
  /// Throws ConfigError if `config` is out of bounds, and std::invalid_argument unless the rate of
  /// `pace` is positive.
  SensorsNode(const SensorsConfig& config, const PlaybackPace& pace,
              std::unique_ptr<DatasetReader> reader, const SensorsTopics& topics);
  ~SensorsNode() override { stop(); }

  std::vector<Heartbeat*> heartbeats() override {
    return {WorkerNode::heartbeats().front(), &decoding_};
  }
  /// Durations of reading and decoding a packet.
  DurationHistogram timing() const override { return reading_.histogram(); }

  /// Numbers of packets published and of frames not used so far. Thread-safe.
  std::size_t published() const { return published_; }
  std::size_t skipped() const { return skipped_; }
  /// Time for which the recording's clock has paused because processors were too slow [s].
  /// Thread-safe.
  double paused_s() const {
    const std::lock_guard lock(shedding_mutex_);
    return paused_s_;
  }
  /// Faults of the source, at most 5 s old; complete after stop(). Thread-safe.
  ReaderReport faults() const {
    const std::lock_guard lock(faults_mutex_);
    return faults_;
  }
  /// Numbers of the rig and of the first packets that are unusual. Thread-safe.
  std::vector<Doubt> doubts() const {
    const std::lock_guard lock(faults_mutex_);
    return doubts_;
  }
  /// Number of pairs of the recording, or the number so far if that is larger. Thread-safe.
  std::size_t listed() const { return std::max<std::size_t>(listed_, published_ + skipped_); }

 private:
  void handle(const Input& input) override {
    std::visit([this](const auto& message) { step(message); }, input);
  }
  void start_sources() override;
  /// Packets that are decoded but not yet due are dropped.
  void stop_sources() noexcept override;
  void decode();
  void note_doubts(const SensorPacket& packet);
  void count_faults();
  void take_faults();
  [[nodiscard]] FrameUse choose_use(Stamp stamp, Stamp arrival);
  [[nodiscard]] FrameUse choose_use(Stamp stamp, double due_s, double now_s);
  [[nodiscard]] double wait_for_odometry(double due_s, double now_s);
  void report_load(const ShedLoad& before, const ShedLoad& now);
  void step(const Topic<SensorPacket>::Message& packet);
  void step(const ReaderReport& end_of_data);
  void step(const std::exception_ptr& failure) { std::rethrow_exception(failure); }

  std::unique_ptr<DatasetReader> reader_;
  const std::size_t listed_;
  const bool is_live_;
  const bool leaves_out_;  // true if images are left out when processors are short
  mutable std::mutex shedding_mutex_;
  LoadShedding shedding_;
  double paused_s_ = 0.0;
  ReplayClock clock_;
  const SensorsTopics topics_;
  std::atomic<std::size_t> published_ = 0;
  std::atomic<std::size_t> skipped_ = 0;
  std::atomic<bool> stopped_ = false;
  mutable std::mutex faults_mutex_;  // guards the two members below
  ReaderReport faults_;
  std::vector<Doubt> doubts_;
  std::string logged_faults_;  // last logged faults of a live source
  double counted_s_ = 0.0;
  FirstPackets first_;       // used by the decoder, like has_looked_
  bool has_looked_ = false;  // at the rig
  Timing reading_;
  Heartbeat decoding_;  // heartbeat of the decoder thread, one step per packet
  GuardedThread decoder_;
};

}  // namespace km
