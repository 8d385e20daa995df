#include "modules/view/node/view_channel_codec.hpp"

#include <view.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/clock.hpp"
#include "runtime/dds/codec.hpp"

namespace km {
namespace {

// Number of updates kept until all readers acknowledge them. The writer keeps the updates for a
// dead viewer until its lease (ViewListener) ends, so fewer than this may arise in that time.
constexpr int kKept = 10000;
// Number of updates that a reader keeps until the application takes them.
constexpr int kMostUntaken = 20000;

const char* name_of(ViewChannel channel) {
  constexpr std::array kNames = {"view", "view_mesh", "view_images"};  // as the enumerators
  return kNames.at(static_cast<std::size_t>(channel));
}

// A volatile update would be lost if it overtook the discovery of its writer. So the writer keeps
// the last update and sends it to each new reader first.
DdsQos view_qos() {
  DdsQos qos = make_dds_qos();
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return qos;
}

DdsQos writer_qos(ViewChannel channel) {
  DdsQos qos = view_qos();
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, channel == ViewChannel::kImages ? 1 : kKept);
  dds_qset_writer_data_lifecycle(qos.get(), false);
  return qos;
}

DdsQos reader_qos() {
  DdsQos qos = view_qos();
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_resource_limits(qos.get(), kMostUntaken, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return qos;
}

// Settings for publishers and subscribers.
DdsQos partition(ViewChannel channel, RobotId robot) {
  DdsQos qos = make_dds_qos();
  if (channel == ViewChannel::kImages)
    dds_qset_partition1(qos.get(), std::to_string(robot).c_str());
  return qos;
}

Stamp system_now() {
  return static_cast<Stamp>(std::llround(wall_now_s() * 1e9));
}

std::optional<ViewUpdate> update_of(const km_wire_ViewUpdate& wire, ViewChannel channel) {
  const auto bytes = elements_of(wire.content, kMaxViewBytes);
  auto content = bytes ? decode_view(*bytes) : std::nullopt;
  if (!content || channel_of(*content) != channel) return std::nullopt;
  if (auto* chunk = std::get_if<MeshChunk>(&*content)) {
    chunk->key.robot = wire.robot;
    chunk->boot = wire.boot;
  }
  return ViewUpdate{wire.robot, wire.boot, wire.sent, *std::move(content)};
}

}  // namespace

ViewChannel channel_of(const ViewContent& content) {
  if (std::holds_alternative<MeshChunk>(content) || std::holds_alternative<ViewObjects>(content) ||
      std::holds_alternative<ViewRaster>(content))
    return ViewChannel::kMesh;
  return std::holds_alternative<ViewImage>(content) ? ViewChannel::kImages : ViewChannel::kView;
}

DdsEntity create_view_topic(dds_entity_t participant, ViewChannel channel) {
  return {
      dds_create_topic(participant, &km_wire_ViewUpdate_desc, name_of(channel), nullptr, nullptr),
      std::string("topic ") + name_of(channel)};
}

ViewWriter::ViewWriter(dds_entity_t participant, ViewChannel channel, const TeamPeer& self)
    : channel_(channel),
      self_(self),
      topic_(create_view_topic(participant, channel)),
      publisher_(dds_create_publisher(participant, partition(channel, self.robot).get(), nullptr),
                 std::string("publisher of ") + name_of(channel)),
      writer_(dds_create_writer(publisher_.handle(), topic_.handle(), writer_qos(channel).get(),
                                nullptr),
              std::string("writer of ") + name_of(channel)) {}

dds_publication_matched_status_t ViewWriter::matched() const {
  dds_publication_matched_status_t status{};
  check_dds(dds_get_publication_matched_status(writer_.handle(), &status),
            std::string("cannot count the readers of ") + name_of(channel_));
  return status;
}

std::size_t ViewWriter::readers() const {
  return matched().current_count;
}

std::size_t ViewWriter::newcomers() {
  const std::size_t come = matched().total_count;
  return come - std::exchange(come_, come);
}

std::size_t ViewWriter::write(const ViewContent& content) {
  std::vector<std::uint8_t> bytes = encode_view(content);
  km_wire_ViewUpdate wire{};
  wire.robot = self_.robot;
  wire.boot = self_.boot;
  wire.sent = system_now();
  borrow(wire.content, bytes);
  check_dds(dds_write(writer_.handle(), &wire),
            std::string("cannot publish on ") + name_of(channel_));
  constexpr std::size_t kHead = 4 + 28;  // Encoding header, and the fields before the content.
  return bytes.size() + kHead;
}

bool ViewWriter::await_readers(double timeout_s) const {
  return dds_wait_for_acks(writer_.handle(), nanoseconds(timeout_s)) == DDS_RETCODE_OK;
}

ViewReader::ViewReader(dds_entity_t participant, dds_entity_t topic, ViewChannel channel,
                       RobotId of)
    : channel_(channel),
      subscriber_(dds_create_subscriber(participant, partition(channel, of).get(), nullptr),
                  std::string("subscriber to ") + name_of(channel)),
      reader_(dds_create_reader(subscriber_.handle(), topic, reader_qos().get(), nullptr),
              std::string("reader of ") + name_of(channel)) {}

std::size_t ViewReader::take(const std::function<void(ViewUpdate)>& take_one) {
  constexpr std::uint32_t kAtOnce = 16;
  std::array<void*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> infos{};
  std::size_t refused = 0;
  while (true) {
    const dds_return_t count =
        check_dds(dds_take(reader_.handle(), samples.data(), infos.data(), kAtOnce, kAtOnce),
                  std::string("cannot take from ") + name_of(channel_));
    if (count == 0) return refused;
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      if (!infos[k].valid_data) continue;
      auto update = update_of(*static_cast<const km_wire_ViewUpdate*>(samples[k]), channel_);
      if (update)
        take_one(*std::move(update));
      else
        ++refused;
    }
    check_dds(dds_return_loan(reader_.handle(), samples.data(), count), "cannot return samples");
  }
}

}  // namespace km
