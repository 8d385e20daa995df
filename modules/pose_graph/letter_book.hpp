#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// What a letter is to the one it has come to.
enum class [[nodiscard]] LetterNews{
    kNew,    ///< It has a content that has not been taken yet.
    kNone,   ///< Word of what has arrived there, or a repetition.
    kFalse,  ///< No member's book could have written it.
};

/// One robot's correspondence with the other members of a session: numbers letters, keeps them
/// until their addressees tell that they have taken them, and sends them again until then. How long
/// it waits for that follows from how long answers take (as the retransmission timer of TCP does,
/// RFC 6298, and its rule of Karn: of what was repeated no time is taken). Letters may be taken in
/// any order, each once; what is not taken comes again. Deterministic; not thread-safe.
class LetterBook {
 public:
  /// `period_s`: first guess of the time that an answer takes.
  LetterBook(TeamPeer self, SessionId session, double period_s)
      : self_(self), session_(std::move(session)), period_s_(period_s) {}

  /// What is sent for a solver's letter.
  [[nodiscard]] SessionLetter write(SolverLetter letter, double now_s);

  /// What arrives; the sender's process is not looked at.
  LetterNews read(const SessionLetter& letter, double now_s);
  /// A new one is in good hands: its sender is told.
  void take(const SessionLetter& letter);

  /// What has to be sent again by now, and word of what has arrived to those that repeat it.
  [[nodiscard]] std::vector<SessionLetter> due(double now_s);
  /// There is a way to `robot` again: what it may have missed is due at once.
  void reachable_again(RobotId robot);

 private:
  struct Waiting {
    SessionLetter letter;
    double sent_s = 0.0;
    int repetitions = 0;
  };
  struct Correspondent {
    std::uint32_t written = 0;
    std::deque<Waiting> waiting = {};          // until they are known to be taken
    std::uint32_t taken = 0;                   // all below this
    std::set<std::uint32_t> taken_early = {};  // beyond
    std::optional<double> answer_s = {};       // mean time until a letter is known to be there
    bool owes_word = false;
  };

  [[nodiscard]] double patience_s(const Correspondent& of, const Waiting& waiting) const;

  TeamPeer self_;
  SessionId session_;
  double period_s_;
  std::map<RobotId, Correspondent> correspondents_;
};

}  // namespace km
