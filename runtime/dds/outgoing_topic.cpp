#include "runtime/dds/outgoing_topic.hpp"

#include <algorithm>

#include "runtime/clock.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Settings of a publisher or subscriber; an empty partition is the default one.
DdsQos partition_qos(const std::string& partition) {
  DdsQos qos = make_dds_qos();
  if (!partition.empty()) dds_qset_partition1(qos.get(), partition.c_str());
  return qos;
}

}  // namespace

std::string partition_of(RobotId robot) {
  return "robot" + std::to_string(robot);
}

std::string partition_of(const TeamPeer& peer, bool is_sealed) {
  return partition_of(peer.robot) + '.' +
         std::to_string(is_sealed ? peer.boot : peer.boot >> kResumeBits);
}

OutgoingTopic::OutgoingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec)
    : participant_(participant), peers_(peers), spec_(std::move(spec)) {
  open();
}

void OutgoingTopic::save(dds_entity_t reader) {
  // Sealed messages name the former participant. Those that are kept are sealed again.
  if (spec_.kind == TopicKind::kStatus || is_sealed()) return;
  for (auto& [to, writer] : writers_) writer.saved = saved(reader, writer);
}

std::vector<OutgoingTopic::Saved> OutgoingTopic::saved(dds_entity_t reader,
                                                       const Writer& writer) const {
  const DdsEntity topic(
      dds_create_topic(reader, &km_wire_Envelope_desc, spec_.name.c_str(), nullptr, nullptr),
      "topic " + spec_.name);
  const DdsQos group = partition_qos(writer.partition);
  const DdsEntity subscriber(dds_create_subscriber(reader, group.get(), nullptr),
                             "subscriber of " + spec_.name);
  const DdsQos qos = make_reader_qos(spec_.kind, participant_.config());
  const DdsEntity history(
      dds_create_reader(subscriber.handle(), topic.handle(), qos.get(), nullptr),
      "reader of " + spec_.name);
  std::vector<Saved> result;
  void* sample = nullptr;
  dds_sample_info_t info;
  while (check_dds(dds_take(history.handle(), &sample, &info, 1, 1), "cannot copy") > 0) {
    const auto& envelope = *static_cast<const km_wire_Envelope*>(sample);
    const auto bytes = elements_of(envelope.content, envelope.content._length);
    if (info.valid_data && bytes && envelope.robot == participant_.identity().robot &&
        envelope.boot == participant_.identity().boot)
      result.push_back({envelope, {bytes->begin(), bytes->end()}});
    dds_return_loan(history.handle(), &sample, 1);
  }
  std::ranges::sort(result, {}, [](const Saved& message) { return message.head.number; });
  return result;
}

void OutgoingTopic::open() {
  topic_ = DdsEntity(dds_create_topic(participant_.handle(), &km_wire_Envelope_desc,
                                      spec_.name.c_str(), nullptr, nullptr),
                     "topic " + spec_.name);
  for (auto& [to, writer] : writers_) {
    {
      const std::lock_guard lock(mutex_);
      open(writer, writer.receiver);
    }
    for (Saved& message : std::exchange(writer.saved, {})) {
      borrow(message.head.content, message.content);
      check_dds(dds_write(writer.writer.handle(), &message.head), "cannot write " + spec_.name);
      add_to_history(writer, message.head.key, envelope_bytes(message.content.size()));
    }
    send_due(writer);
  }
}

bool OutgoingTopic::is_sealed() const {
  return participant_.seal() != nullptr && !spec_.carries_keys;
}

bool OutgoingTopic::is_kept() const {
  return is_sealed() && (spec_.kind == TopicKind::kEvent || spec_.kind == TopicKind::kState);
}

// nullopt if the addressee is unknown, or if its incarnation has ended.
std::optional<TeamPeer> OutgoingTopic::receiver_of(const Addressee& addressee) const {
  if (spec_.carries_keys) return TeamPeer{addressee.robot, 0};
  const auto current = peers_.ask(&PeerTable::current, addressee.robot);
  const bool is_over =
      current && addressee.boot != 0 && !is_same_incarnation(addressee.boot, current->boot);
  return is_over ? std::nullopt : current;
}

std::string OutgoingTopic::partition_for(const std::optional<TeamPeer>& receiver) const {
  if (!receiver) return {};
  return spec_.carries_keys ? partition_of(receiver->robot) : partition_of(*receiver, is_sealed());
}

// When a robot restarts (new boot id), its counters continue and its stored messages are discarded.
OutgoingTopic::Writer& OutgoingTopic::writer_to(const std::optional<TeamPeer>& receiver) {
  const std::lock_guard lock(mutex_);
  const auto [entry, fresh] =
      writers_.try_emplace(receiver ? std::optional(receiver->robot) : std::nullopt);
  Writer& writer = entry->second;
  if (!fresh && writer.partition == partition_for(receiver)) return writer;

  if (!fresh && !is_same_incarnation(writer.receiver->boot, receiver->boot)) writer.kept.clear();
  open(writer, receiver);
  return writer;
}

// Creates the DDS writer, in place of a former one. Precondition: mutex_ is held.
void OutgoingTopic::open(Writer& writer, const std::optional<TeamPeer>& receiver) {
  const std::string partition = partition_for(receiver);
  writer.due.clear();
  for (const auto& [key, content] : writer.kept) writer.due.insert(key);
  writer.receiver = receiver;
  writer.partition = partition;
  writer.readers.clear();
  writer.history = {};
  writer.newest.clear();
  writer.statistics.reset();
  writer.writer = DdsEntity();
  const DdsQos group = partition_qos(partition);
  writer.publisher = DdsEntity(dds_create_publisher(participant_.handle(), group.get(), nullptr),
                               "publisher of " + spec_.name);
  const DdsQos qos = make_writer_qos(spec_.kind, participant_.config());
  writer.writer =
      DdsEntity(dds_create_writer(writer.publisher.handle(), topic_.handle(), qos.get(), nullptr),
                "writer of " + spec_.name);
  writer.statistics.reset(dds_create_statistics(writer.writer.handle()));
}

void OutgoingTopic::write(std::optional<Addressee> addressee, MessageKey key, Octets content) {
  const auto receiver = addressee ? receiver_of(*addressee) : std::nullopt;
  if (addressee && !receiver) return;
  Writer& writer = writer_to(receiver);
  if (!is_kept()) {
    send(writer, key, std::move(content));
    if (spec_.kind == TopicKind::kStatus) announce(writer);
    return;
  }
  writer.kept[key] = std::move(content);
  writer.due.insert(key);
  send_due(writer);
}

void OutgoingTopic::announce(Writer& writer) {
  using enum Peers::AnnouncementDue;
  const auto due = peers_.take_announcement_due(steady_now_s());
  if (due == kNo) return;
  const SharedSeal* seal = participant_.seal();
  const std::string data =
      to_user_data(participant_.identity(), seal == nullptr ? std::string() : seal->credentials());
  send(writer, due == kAsks ? kAskingAnnouncement : kAnnouncement, {data.begin(), data.end()});
}

void OutgoingTopic::catch_up(RobotId robot) {
  const auto receiver = receiver_of({robot});
  if (is_kept() && receiver && writers_.contains(robot)) send_due(writer_to(receiver));
}

void OutgoingTopic::renew(RobotId robot) {
  if (!is_sealed()) return;
  const auto receiver = receiver_of({robot});
  if (receiver && writers_.contains(robot)) renew(receiver);
  if (is_kept() && writers_.contains(std::nullopt)) renew(std::nullopt);
}

void OutgoingTopic::renew(const std::optional<TeamPeer>& receiver) {
  Writer& writer = writer_to(receiver);
  {
    const std::lock_guard lock(mutex_);
    open(writer, receiver);
  }
  send_due(writer);
}

bool OutgoingTopic::is_acknowledged_by(RobotId robot) const {
  const auto entry = writers_.find(robot);
  return entry == writers_.end() || !is_reliable(spec_.kind) ||
         dds_wait_for_acks(entry->second.writer.handle(), 0) == DDS_RETCODE_OK;
}

void OutgoingTopic::send_due(Writer& writer) {
  if (writer.due.empty()) return;
  const bool has_keys = !writer.receiver || participant_.seal()->with([&](const TeamSeal& team) {
    return team.is_admitted(*writer.receiver);
  });
  if (!has_keys) return;
  for (const MessageKey key : std::exchange(writer.due, {})) send(writer, key, writer.kept.at(key));
}

void OutgoingTopic::send(Writer& writer, MessageKey key, Octets content) {
  std::uint32_t& number = writer.next_number[writer.partition];
  km_wire_Envelope envelope{.key = key,
                            .boot = participant_.identity().boot,
                            .number = number,
                            .version = spec_.version,
                            .robot = participant_.identity().robot,
                            .content = {}};
  const bool announces = is_announcement(spec_.kind, key);
  const char* problem = content.size() > spec_.max_bytes ? "too large"
                        : announces                      ? nullptr
                                                         : seal(writer, envelope, content);
  if (problem == nullptr) {
    borrow(envelope.content, content);
    const dds_return_t result = dds_write(writer.writer.handle(), &envelope);
    if (result != DDS_RETCODE_OK) problem = dds_strretcode(result);
  }
  refresh_readers(writer);
  if (problem != nullptr)
    log::limited(log::Level::kError, "dds", "write " + spec_.name)
        << spec_.name << ": message " << number << " of " << content.size()
        << " bytes not written: " << problem;
  const std::lock_guard lock(mutex_);
  if (problem != nullptr) {
    ++not_written_[problem];
    return;
  }
  if (!announces) ++number;  // the number of statuses is a time, see PeerTable::twin_received()
  const std::uint64_t size = envelope_bytes(content.size());
  writer.written.add(size);
  add_to_history(writer, key, size);
  for (const Guid& reader : writer.readers) writer.sent_to[reader].add(size);
}

// For a state, counts only the newest message of each key. Requests soon expire, so they count only
// for the first reader.
void OutgoingTopic::add_to_history(Writer& writer, MessageKey key, std::uint64_t bytes) const {
  if (spec_.kind == TopicKind::kStatus) return;
  if (spec_.kind == TopicKind::kRequest && !writer.readers.empty()) return;
  if (spec_.kind == TopicKind::kState) {
    const auto [newest, is_first] = writer.newest.try_emplace(key, bytes);
    if (!is_first) {
      writer.history.bytes += bytes - std::exchange(newest->second, bytes);
      return;
    }
  }
  writer.history.add(bytes);
}

void OutgoingTopic::notice_readers() {
  for (auto& [to, writer] : writers_) refresh_readers(writer);
}

std::vector<RobotId> OutgoingTopic::readers_of(std::optional<Addressee> addressee) {
  if (addressee)
    return receiver_of(*addressee) ? std::vector{addressee->robot} : std::vector<RobotId>();
  Writer& writer = writer_to({});
  refresh_readers(writer);
  std::vector<RobotId> robots;
  for (const Guid& reader : writer.readers)
    if (const auto identity = peers_.ask(&PeerTable::identity_of, reader))
      robots.push_back(identity->robot);
  return robots;
}

// Returns null, or the reason why the content cannot be sealed.
const char* OutgoingTopic::seal(const Writer& writer, const km_wire_Envelope& head,
                                Octets& content) const {
  if (!is_sealed()) return nullptr;
  const SealContext context = seal_context(spec_.name, participant_.guid(), head, writer.receiver);
  auto sealed =
      participant_.seal()->with([&](const TeamSeal& team) { return team.seal(context, content); });
  if (!sealed) return "the keys of its addressee are unknown";
  content = std::move(*sealed);
  return nullptr;
}

// Called on the writing thread only, because Writer::readers belongs to it.
void OutgoingTopic::refresh_readers(Writer& writer) {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(writer.writer.handle(), &status);
  if (status.total_count_change == 0 && status.current_count_change == 0) return;

  std::vector<dds_instance_handle_t> handles(status.current_count + 8U);
  const dds_return_t count =
      dds_get_matched_subscriptions(writer.writer.handle(), handles.data(), handles.size());
  handles.resize(std::min(handles.size(), static_cast<std::size_t>(std::max(count, 0))));
  const std::vector<Guid> former = std::exchange(writer.readers, {});
  const std::lock_guard lock(mutex_);
  for (const dds_instance_handle_t handle : handles) {
    const auto guid = participant_of_subscription(writer.writer.handle(), handle);
    if (!guid) continue;
    writer.readers.push_back(*guid);
    if (std::ranges::find(former, *guid) != former.end()) continue;
    writer.sent_to[*guid].add(writer.history);
    newcomers_ |= writer.history.bytes > 0;
  }
  if (spec_.kind == TopicKind::kRequest && !writer.readers.empty()) writer.history = {};
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

std::uint64_t OutgoingTopic::sent_bytes() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& [to, writer] : writers_) {
    bytes += retransmitted_bytes(writer);
    for (const auto& [reader, count] : writer.sent_to) bytes += count.bytes;
  }
  return bytes;
}

void OutgoingTopic::add_to(TrafficSnapshot& snapshot) const {
  TopicTraffic total{.topic = spec_.name, .category = spec_.category, .direction = Direction::kOut};
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
    total.count.add(writer.written);
    row_of(to).retransmitted_bytes += retransmitted_bytes(writer);
    for (const auto& [guid, count] : writer.sent_to) {
      const auto identity = peers_.ask(&PeerTable::identity_of, guid);
      row_of(identity ? std::optional(identity->robot) : std::nullopt).count.add(count);
    }
  }
  total.refused = not_written_;
  snapshot.topics.push_back(std::move(total));
  for (auto& [peer, row] : rows) snapshot.peers.push_back(std::move(row));
}

}  // namespace km
