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

void log_lines(const std::string& text, std::string_view name) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) log::warn(name) << line;
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
  if (!decoder_.joinable()) return;
  decoder_.join();
  take_faults();
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
      count_faults();
      if (!packet) {
        worker_.post(EndOfData{reader_->report()});
        return;
      }
      auto data = std::make_shared<const SensorPacket>(std::move(*packet));
      if (!worker_.post(Packet{std::move(data), reader_->arrival()})) return;
    }
  } catch (...) {
    worker_.post(std::current_exception());  // the worker ends with it, as any node does
  }
}

void SensorsNode::count_faults() {
  constexpr double kInterval_s = 5.0;
  const double now_s = steady_now_s();
  if (now_s - counted_s_ < kInterval_s) return;
  counted_s_ = now_s;
  take_faults();
}

// What is live has no end at which to tell them.
void SensorsNode::take_faults() {
  const ReaderReport report = reader_->report();
  {
    const std::lock_guard lock(faults_mutex_);
    faults_ = report;
  }
  if (!reader_->is_live()) return;
  const std::string faults = to_string(report);
  if (faults != told_faults_) log_lines(faults, name());
  told_faults_ = faults;
}

// Nullopt: stopped meanwhile.
std::optional<double> SensorsNode::lag_when_due_s(const Packet& packet) {
  if (packet.arrival != 0)
    return stopped_ ? std::nullopt
                    : std::optional(wall_now_s() - 1e-9 * static_cast<double>(packet.arrival));
  const Heartbeat::Waiting waiting;
  return clock_.wait_until(packet.data->frame->stamp) ? std::optional(clock_.lag_s())
                                                      : std::nullopt;
}

void SensorsNode::step(const Packet& packet) {
  const auto lag_s = lag_when_due_s(packet);
  if (!lag_s) return;
  if (const auto due = filter_.take(packet.data, *lag_s)) {
    topics_.packets.publish(due);
    ++published_;
  } else {
    ++skipped_;
    log::limited(log::Level::kWarn, name(), "lag")
        << "frame skipped, consumers lag behind: " << skipped_ << " of " << listed();
  }
}

void SensorsNode::step(const EndOfData& data) {
  if (stopped_) return;
  log_lines(to_string(data.faults), name());
  log::info(name()) << "end of data: " << published_ << " frames, " << skipped_ << " skipped";
  topics_.end.publish(SensorsEnd{published_, skipped_, data.faults});
}

}  // namespace km
