#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/robust/member_solver.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// Result of the arrival of a message.
enum class [[nodiscard]] ReliableArrival{
    kNew,    ///< Content that has not been taken yet.
    kNone,   ///< An acknowledgement without content, or a repetition.
    kFalse,  ///< A message that no correct member sends.
};

/// Reliable messages of one robot to the other members of a session. It numbers messages, keeps
/// them until their receivers acknowledge them, and repeats them until then. The timeout follows
/// from the measured response time, as in the retransmission timer of TCP (RFC 6298). By Karn's
/// rule, repeated messages do not count for the response time. The receiver may take messages in
/// any order, each once; a message that it does not take is sent again. Deterministic; not
/// thread-safe.
class ReliableChannel {
 public:
  /// `period_s`: initial estimate of the response time.
  ReliableChannel(TeamPeer self, const SessionId& session, double period_s)
      : self_(self), session_(session), period_s_(period_s) {}

  /// The message on the network for a message of the solver.
  [[nodiscard]] ReliableMessage write(SolverMessage message, double now_s);

  /// Processes a message that has arrived. It does not check the boot id of the sender.
  ReliableArrival read(const ReliableMessage& message, double now_s);
  /// Marks a new message as taken: its sender will receive an acknowledgement.
  void take(const ReliableMessage& message);

  /// The messages that are due for repetition, and acknowledgements for the robots that repeat
  /// theirs.
  [[nodiscard]] std::vector<ReliableMessage> due(double now_s);
  /// Reports that `robot` is reachable again: messages that it may have missed are due at once.
  void reachable_again(RobotId robot);

 private:
  struct Waiting {
    ReliableMessage message;
    double sent_s = 0.0;
    int repetitions = 0;
  };
  struct Correspondent {
    std::uint32_t written = 0;
    std::deque<Waiting> waiting = {};          // until they are acknowledged
    std::uint32_t taken = 0;                   // all numbers below this are taken
    std::set<std::uint32_t> taken_early = {};  // taken numbers above `taken`
    std::optional<double> answer_s = {};       // mean time until an acknowledgement
    bool owes_acknowledgement = false;
  };

  [[nodiscard]] double patience_s(const Correspondent& of, const Waiting& waiting) const;

  TeamPeer self_;
  SessionId session_;
  double period_s_;
  std::map<RobotId, Correspondent> correspondents_;
};

}  // namespace km
