#include "runtime/dds/incoming_topic.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <iterator>

#include "runtime/dds/qos.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxStreams = 4096;  // boots of robots remembered per topic
constexpr std::size_t kMaxWriters = 4096;

struct SerdataDeleter {
  void operator()(ddsi_serdata* data) const { ddsi_serdata_unref(data); }
};
using Serdata = std::unique_ptr<ddsi_serdata, SerdataDeleter>;

// Frees what DDS allocated inside a C sample.
class SampleContents {
 public:
  SampleContents(void* sample, const dds_topic_descriptor_t& type) : sample_(sample), type_(type) {
    std::memset(sample, 0, type.m_size);
  }
  ~SampleContents() { dds_sample_free(sample_, &type_, DDS_FREE_CONTENTS); }
  SampleContents(const SampleContents&) = delete;
  SampleContents& operator=(const SampleContents&) = delete;

 private:
  void* sample_;
  const dds_topic_descriptor_t& type_;
};

}  // namespace

bool SequenceTracker::is_new(std::uint32_t number) {
  const std::uint64_t begin = number;
  std::uint64_t end = begin + 1;
  auto next = end_of_run_.upper_bound(begin);
  const bool has_previous = next != end_of_run_.begin();
  const auto previous = has_previous ? std::prev(next) : end_of_run_.end();
  if (has_previous && previous->second > begin) return false;

  if (next != end_of_run_.end() && next->first == end) {
    end = next->second;
    next = end_of_run_.erase(next);
  }
  if (has_previous && previous->second == begin) {
    previous->second = end;
  } else {
    end_of_run_.emplace_hint(next, begin, end);
  }

  if (end_of_run_.size() > kMaxIntervals) {
    const auto first = end_of_run_.begin();
    const auto second = std::next(first);
    lost_ += second->first - first->second;
    first->second = second->second;
    end_of_run_.erase(second);
  }
  return true;
}

std::uint64_t SequenceTracker::missing() const {
  std::uint64_t count = lost_;
  std::uint64_t expected = from_zero_ || end_of_run_.empty() ? 0 : end_of_run_.begin()->first;
  for (const auto& [begin, end] : end_of_run_) {
    count += begin - expected;
    expected = end;
  }
  return count;
}

IncomingTopic::IncomingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec,
                             bool addressed, HeaderOf header_of, Handler handler)
    : participant_(participant),
      peers_(peers),
      spec_(std::move(spec)),
      header_of_(header_of),
      handler_(std::move(handler)),
      sample_(spec_.descriptor->m_size / sizeof(std::max_align_t) + 1),
      topic_(dds_create_topic(participant.handle(), spec_.descriptor, spec_.name.c_str(), nullptr,
                              nullptr),
             "topic " + spec_.name) {
  const DdsQos partition = make_dds_qos();
  if (addressed)
    dds_qset_partition1(partition.get(), partition_of(participant.identity().robot).c_str());
  subscriber_ = DdsEntity(dds_create_subscriber(participant.handle(), partition.get(), nullptr),
                          "subscriber of " + spec_.name);
  const bool presence = spec_.kind == TopicKind::kStatus;
  const DdsQos qos = make_topic_qos(spec_.kind, participant.config());
  reader_ = DdsEntity(dds_create_reader(subscriber_.handle(), topic_.handle(), qos.get(),
                                        presence ? peers.liveliness_listener() : nullptr),
                      "reader of " + spec_.name);
  if (presence) peers.watch(reader_.handle());
  condition_ =
      DdsEntity(dds_create_readcondition(reader_.handle(), DDS_ANY_STATE), "read condition");
}

void IncomingTopic::take(double now_s) {
  constexpr std::uint32_t kBatch = 32;
  while (true) {
    std::array<ddsi_serdata*, kBatch> taken{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const auto count = static_cast<std::size_t>(
        check_dds(dds_takecdr(reader_.handle(), taken.data(), kBatch, infos.data(), DDS_ANY_STATE),
                  "cannot take " + spec_.name));
    if (count == 0) return;
    std::array<Serdata, kBatch> owners;
    for (std::size_t i = 0; i < count; ++i) owners[i].reset(taken[i]);
    for (std::size_t i = 0; i < count; ++i)
      if (infos[i].valid_data) handle(*owners[i], infos[i].publication_handle, now_s);
  }
}

void IncomingTopic::handle(const ddsi_serdata& serialized, dds_instance_handle_t writer,
                           double now_s) {
  const SampleContents contents(sample_.data(), *spec_.descriptor);
  const char* refusal = "not deserializable";
  if (ddsi_serdata_to_sample(&serialized, sample_.data(), nullptr, nullptr))
    refusal = accept(sample_.data(), ddsi_serdata_size(&serialized), writer, now_s);
  if (refusal == nullptr) return;
  {
    const std::lock_guard lock(mutex_);
    ++refused_[refusal];
  }
  log::limited(log::Level::kWarn, "dds", spec_.name + refusal)
      << spec_.name << ": message refused: " << refusal;
}

// Null, or why the message is refused. A duplicate is neither.
const char* IncomingTopic::accept(const void* wire, std::uint64_t size,
                                  dds_instance_handle_t writer, double now_s) {
  const km_wire_Header& header = header_of_(wire);
  if (const char* refusal = check_sender(header, writer, now_s)) return refusal;
  if (header.version == 0) return "unknown version of the topic";
  {
    const std::lock_guard lock(mutex_);
    if (!is_new(header)) {
      ++duplicates_;
      return nullptr;
    }
    from_[header.robot].add(size);
  }
  try {
    return handler_(wire);
  } catch (const std::exception& e) {
    log::limited(log::Level::kError, "dds", spec_.name + e.what())
        << spec_.name << ": " << e.what();
    return "its handling threw an exception";
  }
}

const char* IncomingTopic::check_sender(const km_wire_Header& header, dds_instance_handle_t writer,
                                        double now_s) {
  if (header.robot == participant_.identity().robot) return "claims this robot's id";
  const auto guid = participant_of(writer);
  // Its participant may have been discovered a moment ago, or be gone by now.
  if (!peers_.has_met(header.robot, header.boot)) peers_.poll(now_s);
  if (!peers_.has_met(header.robot, header.boot)) return "from no known robot";
  if (!guid) return nullptr;
  const auto identity = peers_.identity_of(*guid);
  if (!identity) return "from no known robot";
  if (identity->robot != header.robot || identity->boot != header.boot)
    return "claims another robot's id";
  return nullptr;
}

std::optional<Guid> IncomingTopic::participant_of(dds_instance_handle_t writer) {
  const auto known = participant_of_writer_.find(writer);
  if (known != participant_of_writer_.end()) return known->second;
  const auto guid = participant_of_publication(reader_.handle(), writer);
  if (participant_of_writer_.size() >= kMaxWriters) participant_of_writer_.clear();
  if (guid) participant_of_writer_.emplace(writer, *guid);
  return guid;
}

bool IncomingTopic::is_new(const km_wire_Header& header) {
  const Stream stream(header.robot, header.boot);
  if (streams_.size() >= kMaxStreams && !streams_.contains(stream)) streams_.clear();
  const auto entry = streams_.try_emplace(stream, has_full_history(spec_.kind)).first;
  return entry->second.is_new(header.number);
}

void IncomingTopic::add_to(TrafficSnapshot& snapshot) const {
  TopicTraffic total{.topic = spec_.name,
                     .category = spec_.category,
                     .direction = Direction::kIn,
                     .count = {},
                     .refused = {}};
  const std::lock_guard lock(mutex_);
  for (const auto& [robot, count] : from_) {
    total.count.messages += count.messages;
    total.count.bytes += count.bytes;
    snapshot.peers.push_back({.topic = spec_.name,
                              .category = spec_.category,
                              .direction = Direction::kIn,
                              .peer = robot,
                              .count = count});
  }
  for (const auto& [stream, tracker] : streams_) total.missing += tracker.missing();
  total.duplicates = duplicates_;
  total.refused = refused_;
  snapshot.topics.push_back(std::move(total));
}

}  // namespace km
