#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/sensors_config.hpp"
#include "runtime/clock.hpp"
#include "runtime/metrics.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Gives up the images of packets that come too late, as a camera would overwrite them, and keeps
/// their inertial samples.
class LagFilter {
 public:
  /// Throws std::invalid_argument unless max_lag_s >= 0.
  explicit LagFilter(double max_lag_s);

  /// What to publish of a packet that is `lag_s` late: the packet, with the samples of those given
  /// up before it in front of its own; or null if it is given up itself.
  [[nodiscard]] std::shared_ptr<const SensorPacket> take(
      const std::shared_ptr<const SensorPacket>& packet, double lag_s);

 private:
  double max_lag_s_;
  std::vector<ImuSample> held_back_;  // of the packets given up since the last one taken
};

/// The recording is over; published once, after its last packet. Not published by a stop before.
struct SensorsEnd {
  std::size_t published = 0;  ///< Packets.
  std::size_t skipped = 0;    ///< Pairs given up because consumers lagged behind the rate.
  ReaderReport faults;        ///< Of the recording.
};

/// Channels of the sensors node; they must outlive it.
struct SensorsTopics {
  Out<SensorPacket> packets;
  Out<SensorsEnd> end;
};

/// Plays a recording, or hands on what sensors measure now. One thread decodes ahead, another
/// publishes each packet when it is due, which is at once if it is live; a consumer whose queue is
/// full (kBlock) holds publication up, and at a finite rate pairs that became later than max_lag_s
/// are skipped, their inertial samples kept.
class SensorsNode final : public Node {
 public:
  /// `rate`: dataset seconds per second; infinity: as fast as consumers take it. Throws ConfigError
  /// if `config` is out of bounds and std::invalid_argument for a bad rate.
  SensorsNode(const SensorsConfig& config, double rate, std::unique_ptr<DatasetReader> reader,
              const SensorsTopics& topics);
  ~SensorsNode() override { stop(); }

  std::string_view name() const override { return "sensors"; }
  void start() override;
  /// Ends at once: what is decoded but not yet due has not happened.
  void stop() noexcept override;
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat(), &decoding_}; }
  /// Reading and decoding a packet.
  DurationHistogram timing() const override { return reading_.histogram(); }

  /// Packets published and pairs skipped so far. Thread-safe.
  std::size_t published() const { return published_; }
  std::size_t skipped() const { return skipped_; }
  /// Faults of the source, as counted up to 5 s ago, and all of them after stop(). Thread-safe.
  ReaderReport faults() const {
    const std::lock_guard lock(faults_mutex_);
    return faults_;
  }
  /// Pairs of the recording, or so far, where that is more. Thread-safe.
  std::size_t listed() const { return std::max<std::size_t>(listed_, published_ + skipped_); }

 private:
  struct EndOfData {
    ReaderReport faults;
  };
  struct Packet {
    std::shared_ptr<const SensorPacket> data;
    Stamp arrival = 0;  // see DatasetReader
  };
  using Input = std::variant<Packet, EndOfData, std::exception_ptr>;

  void decode();
  void count_faults();
  void take_faults();
  [[nodiscard]] std::optional<double> lag_when_due_s(const Packet& packet);
  void step(const Packet& packet);
  void step(const EndOfData& end);
  void step(const std::exception_ptr& failure) { std::rethrow_exception(failure); }

  std::unique_ptr<DatasetReader> reader_;
  const std::size_t listed_;
  LagFilter filter_;
  ReplayClock clock_;
  const SensorsTopics topics_;
  std::atomic<std::size_t> published_ = 0;
  std::atomic<std::size_t> skipped_ = 0;
  std::atomic<bool> stopped_ = false;
  mutable std::mutex faults_mutex_;
  ReaderReport faults_;
  std::string told_faults_;  // of a live source
  double counted_s_ = 0.0;
  Timing reading_;
  Heartbeat decoding_;  // a step reads one packet
  std::thread decoder_;
  Worker<Input> worker_;  // last member: stops first
};

}  // namespace km
