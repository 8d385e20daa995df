#pragma once

#include <dds/ddsi/ddsi_serdata.h>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/dds/outgoing_topic.hpp"

namespace km {

/// Which numbers of a counted stream have arrived, in whatever order: drops duplicates, counts
/// gaps. Memory is bounded: of more than kMaxIntervals separate runs, the oldest are joined, and
/// what lay between them stays missing for good.
class SequenceTracker {
 public:
  static constexpr std::size_t kMaxIntervals = 1024;

  /// `from_zero`: the stream is expected whole, else from the lowest number that arrives.
  explicit SequenceTracker(bool from_zero) : from_zero_(from_zero) {}

  /// Records `number`. False if it had arrived before.
  [[nodiscard]] bool is_new(std::uint32_t number);

  /// How many numbers below the highest have not arrived (yet).
  [[nodiscard]] std::uint64_t missing() const;

 private:
  bool from_zero_;
  std::uint64_t lost_ = 0;                             // given up in joined runs
  std::map<std::uint64_t, std::uint64_t> end_of_run_;  // begin -> end, half open, disjoint
};

/// The receiving end of a topic. Everything that arrives is untrusted: what is not from an
/// accepted peer, not new, or not decodable is counted by reason, logged at a limited rate, and
/// goes no further. take() belongs to the receive thread; add_to() is thread-safe.
class IncomingTopic {
 public:
  /// Gets a sample of the topic's C type; publishes it, or returns why not (a string literal).
  using Handler = std::function<const char*(const void* wire)>;
  /// The header inside a sample of the topic's C type.
  using HeaderOf = const km_wire_Header& (*)(const void* wire);

  /// `addressed`: takes only what is sent to this robot alone, else only what is sent to all.
  IncomingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec, bool addressed,
                HeaderOf header_of, Handler handler);

  /// Triggers while there is something to take.
  [[nodiscard]] dds_entity_t condition() const { return condition_.handle(); }

  /// Handles everything there is.
  void take(double now_s);

  void add_to(TrafficSnapshot& snapshot) const;

 private:
  using Stream = std::pair<RobotId, std::uint64_t>;  // robot and boot

  void handle(const ddsi_serdata& serialized, dds_instance_handle_t writer, double now_s);
  const char* accept(const void* wire, std::uint64_t size, dds_instance_handle_t writer,
                     double now_s);
  const char* check_sender(const km_wire_Header& header, dds_instance_handle_t writer,
                           double now_s);
  std::optional<Guid> participant_of(dds_instance_handle_t writer);
  bool is_new(const km_wire_Header& header);

  const DdsParticipant& participant_;
  Peers& peers_;
  TopicSpec spec_;
  HeaderOf header_of_;
  Handler handler_;
  std::vector<std::max_align_t> sample_;                         // one C sample, reused
  std::map<dds_instance_handle_t, Guid> participant_of_writer_;  // receive thread only

  mutable std::mutex mutex_;  // guards the counts
  std::map<Stream, SequenceTracker> streams_;
  std::map<RobotId, TrafficCount> from_;
  std::uint64_t duplicates_ = 0;
  std::map<std::string, std::uint64_t> refused_;

  DdsEntity topic_;
  DdsEntity subscriber_;
  DdsEntity reader_;
  DdsEntity condition_;
};

}  // namespace km
