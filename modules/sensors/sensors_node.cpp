#include "modules/sensors/sensors_node.hpp"

#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

// The first sample of a packet repeats the last of the one before.
void append(std::vector<ImuSample>& samples, const std::vector<ImuSample>& next) {
  const bool repeats = !samples.empty() && !next.empty() && next[0].stamp == samples.back().stamp;
  samples.insert(samples.end(), next.begin() + (repeats ? 1 : 0), next.end());
}

}  // namespace

LagFilter::LagFilter(double max_lag_s) : max_lag_s_(max_lag_s) {
  if (!(max_lag_s >= 0.0))
    throw std::invalid_argument("LagFilter: max_lag_s " + std::to_string(max_lag_s) +
                                " is negative");
}

std::shared_ptr<const SensorPacket> LagFilter::take(
    const std::shared_ptr<const SensorPacket>& packet, double lag_s) {
  if (lag_s > max_lag_s_) {
    append(held_back_, packet->imu);
    return nullptr;
  }
  if (held_back_.empty()) return packet;
  auto joined =
      std::make_shared<SensorPacket>(SensorPacket{packet->frame, std::exchange(held_back_, {})});
  append(joined->imu, packet->imu);
  return joined;
}

SensorsNode::SensorsNode(const SensorsConfig& config, double rate,
                         std::unique_ptr<DatasetReader> reader, const SensorsTopics& topics)
    : reader_(std::move(reader)),
      listed_(reader_->pair_count()),
      filter_(checked(config).max_lag_s),
      clock_(rate),
      topics_(topics),
      worker_(
          static_cast<std::size_t>(config.read_ahead), Overflow::kBlock,
          [this](const Input& input) {
            std::visit([this](const auto& message) { step(message); }, input);
          },
          "sensors") {}

void SensorsNode::start() {
  worker_.start();
  decoder_ = std::thread(&SensorsNode::decode, this);
}

void SensorsNode::stop() noexcept {
  stopped_ = true;
  reader_->stop();
  clock_.stop();
  worker_.stop();  // refuses further posts, so that the decoder ends too
  if (decoder_.joinable()) decoder_.join();
}

void SensorsNode::decode() {
  bool has_remarked = false;
  try {
    while (!stopped_) {
      auto packet = [this] {
        const Heartbeat::Step step(decoding_);
        const auto scope = reading_.measure();
        return reader_->next();
      }();
      if (!std::exchange(has_remarked, true))
        for (const std::string& remark : reader_->remarks()) log::info(name()) << remark;
      if (!packet) {
        worker_.post(EndOfData{reader_->report()});
        return;
      }
      if (!worker_.post(std::make_shared<const SensorPacket>(std::move(*packet)))) return;
    }
  } catch (...) {
    worker_.post(std::current_exception());  // the worker ends with it, as any node does
  }
}

// Nullopt: stopped meanwhile.
std::optional<double> SensorsNode::lag_when_due_s(Stamp stamp) {
  if (reader_->is_live())
    return stopped_ ? std::nullopt : std::optional(latency_.lag_s(stamp, steady_now_s()));
  const Heartbeat::Waiting waiting;
  return clock_.wait_until(stamp) ? std::optional(clock_.lag_s()) : std::nullopt;
}

void SensorsNode::step(const Packet& packet) {
  const auto lag_s = lag_when_due_s(packet->frame->stamp);
  if (!lag_s) return;
  if (const Packet due = filter_.take(packet, *lag_s)) {
    topics_.packets.publish(due);
    ++published_;
  } else {
    ++skipped_;
    log::limited(log::Level::kWarn, name(), "lag")
        << "frame skipped, consumers lag behind: " << skipped_ << " of "
        << std::max(listed_, skipped_ + published_);
  }
}

void SensorsNode::step(const EndOfData& data) {
  if (stopped_) return;
  std::istringstream faults(to_string(data.faults));
  for (std::string line; std::getline(faults, line);) log::warn(name()) << line;
  log::info(name()) << "end of data: " << published_ << " frames, " << skipped_ << " skipped";
  topics_.end.publish(SensorsEnd{published_, skipped_, data.faults});
}

}  // namespace km
