#include "runtime/dds/outgoing_topic.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>

#include "runtime/dds/qos.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Bytes of `wire` as DDS sends it: encoding header included, padded to 4. Serialises a second time:
// dds_write() does not tell, and dds_writecdr() needs the writer's ddsi_sertype, to which Cyclone
// 0.10 gives no access. Measured: 24 us for a keyframe of 1,000 points.
std::uint64_t serialized_size(const dds_topic_descriptor_t& type, const void* wire) {
  constexpr std::uint32_t kXcdr2 = 2;  // the encoding of @appendable types
  constexpr std::uint64_t kEncodingHeader = 4;
  dds_ostream_t stream;
  dds_ostream_init(&stream, 0, kXcdr2);
  dds_stream_write(&stream, static_cast<const char*>(wire), type.m_ops);
  const std::uint64_t size = stream.m_index;
  dds_ostream_fini(&stream);
  return (kEncodingHeader + size + 3) / 4 * 4;
}

}  // namespace

std::string partition_of(RobotId robot) {
  return "robot" + std::to_string(robot);
}

OutgoingTopic::OutgoingTopic(const DdsParticipant& participant, const Peers& peers, TopicSpec spec)
    : participant_(participant),
      peers_(peers),
      spec_(std::move(spec)),
      topic_(dds_create_topic(participant.handle(), spec_.descriptor, spec_.name.c_str(), nullptr,
                              nullptr),
             "topic " + spec_.name) {}

OutgoingTopic::Writer& OutgoingTopic::writer_to(std::optional<RobotId> to) {
  const std::lock_guard lock(mutex_);
  const auto [entry, fresh] = writers_.try_emplace(to);
  Writer& writer = entry->second;
  if (!fresh) return writer;

  const DdsQos partition = make_dds_qos();
  if (to) dds_qset_partition1(partition.get(), partition_of(*to).c_str());
  writer.publisher =
      DdsEntity(dds_create_publisher(participant_.handle(), partition.get(), nullptr),
                "publisher of " + spec_.name);
  const DdsQos qos = make_topic_qos(spec_.kind, participant_.config());
  writer.writer =
      DdsEntity(dds_create_writer(writer.publisher.handle(), topic_.handle(), qos.get(), nullptr),
                "writer of " + spec_.name);
  writer.statistics.reset(dds_create_statistics(writer.writer.handle()));
  return writer;
}

void OutgoingTopic::write(std::optional<RobotId> to, km_wire_Header& header, const void* wire) {
  Writer& writer = writer_to(to);
  header.robot = participant_.identity().robot;
  header.boot = participant_.identity().boot;
  header.number = writer.next_number++;
  const std::uint64_t size = serialized_size(*spec_.descriptor, wire);

  const dds_return_t result = dds_write(writer.writer.handle(), wire);
  refresh_readers(writer);
  if (result != DDS_RETCODE_OK)
    log::limited(log::Level::kError, "dds", "write " + spec_.name)
        << spec_.name << ": message " << header.number << " of " << size
        << " bytes not written: " << dds_strretcode(result);
  const std::lock_guard lock(mutex_);
  if (result != DDS_RETCODE_OK) {
    ++writer.failures;
    return;
  }
  writer.written.add(size);
  for (const Guid& reader : writer.readers) writer.sent_to[reader].add(size);
}

// Called on the writing thread only, as readers_ is used by it alone.
void OutgoingTopic::refresh_readers(Writer& writer) {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(writer.writer.handle(), &status);
  if (status.total_count_change == 0 && status.current_count_change == 0) return;

  std::vector<dds_instance_handle_t> handles(status.current_count + 8U);
  const dds_return_t count =
      dds_get_matched_subscriptions(writer.writer.handle(), handles.data(), handles.size());
  handles.resize(std::min(handles.size(), static_cast<std::size_t>(std::max(count, 0))));
  writer.readers.clear();
  for (const dds_instance_handle_t handle : handles)
    if (const auto guid = participant_of_subscription(writer.writer.handle(), handle))
      writer.readers.push_back(*guid);
}

bool OutgoingTopic::wait_for_acks(std::chrono::nanoseconds timeout) {
  if (!is_reliable(spec_.kind)) return true;
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  bool complete = true;
  for (auto& [to, writer] : writers_) {
    const auto left = deadline - std::chrono::steady_clock::now();
    const auto wait = std::max<dds_duration_t>(0, std::chrono::nanoseconds(left).count());
    complete &= dds_wait_for_acks(writer.writer.handle(), wait) == DDS_RETCODE_OK;
  }
  return complete;
}

std::uint64_t OutgoingTopic::retransmitted_bytes(const Writer& writer) {
  dds_statistics* statistics = writer.statistics.get();
  if (statistics == nullptr || dds_refresh_statistics(statistics) != DDS_RETCODE_OK) return 0;
  const dds_stat_keyvalue* entry = dds_lookup_statistic(statistics, "rexmit_bytes");
  return entry == nullptr ? 0 : entry->u.u64;
}

void OutgoingTopic::add_to(TrafficSnapshot& snapshot) const {
  TopicTraffic total{.topic = spec_.name,
                     .category = spec_.category,
                     .direction = Direction::kOut,
                     .count = {},
                     .refused = {}};
  std::map<std::optional<RobotId>, PeerTraffic> rows;
  const auto row_of = [&](std::optional<RobotId> peer) -> PeerTraffic& {
    return rows
        .try_emplace(peer, PeerTraffic{.topic = spec_.name,
                                       .category = spec_.category,
                                       .direction = Direction::kOut,
                                       .peer = peer,
                                       .count = {}})
        .first->second;
  };
  const std::lock_guard lock(mutex_);
  for (const auto& [to, writer] : writers_) {
    total.count.messages += writer.written.messages;
    total.count.bytes += writer.written.bytes;
    total.failures += writer.failures;
    row_of(to).retransmitted_bytes += retransmitted_bytes(writer);
    for (const auto& [guid, count] : writer.sent_to) {
      const auto identity = peers_.identity_of(guid);
      PeerTraffic& row = row_of(identity ? std::optional(identity->robot) : std::nullopt);
      row.count.messages += count.messages;
      row.count.bytes += count.bytes;
    }
  }
  snapshot.topics.push_back(std::move(total));
  for (auto& [peer, row] : rows) snapshot.peers.push_back(std::move(row));
}

}  // namespace km
