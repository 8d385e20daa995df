#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "modules/core/closure_verdicts.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/closure_noise.hpp"

namespace km {

/// What a solver sends to one other member. Its content is the solver's own business; the sizes
/// are those on the wire.
struct SolverLetter {
  RobotId to = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

/// A closure that was set aside unheard is weighed again in the next session, at most kChances
/// times, if its residual is up to kSecondChance times barc: what it would have pulled at is loose
/// without it.
inline constexpr double kSecondChance = 5.0;
inline constexpr int kChances = 2;

/// How far the team is, as this member knows it.
struct SolverState {
  std::uint32_t round = 0;   ///< Rounds of the team that are complete.
  double cost = 0.0;         ///< Of the team, at poses(), with the weights of the closures there.
  double gradient = 0.0;     ///< Newton: sqrt(g^T H^-1 g); rbcd: norm of the Riemannian gradient.
  double noise_scale = 1.0;  ///< Of the closures, as the team has found it.
  double barc = 0.0;  ///< Largest residual of a closure that is kept [sigma]; 0: none is rejected.
  std::uint32_t lag = 1;   ///< Every member has had the poses() of `round` less so many.
  bool set_aside = false;  ///< Closures that stand alone were not heard: they may be true.
  bool held = false;       ///< Poses of robots that have gone hold those of the team.
  bool failed = false;     ///< Given up: the graph of the team could not be solved.
};

/// One robot's part in solving the graph of a session. Letters may come early, late, repeatedly and
/// in any order; none is lost for ever, for their senders repeat what was not taken. Deterministic;
/// not thread-safe.
class MemberSolver {
 public:
  virtual ~MemberSolver() = default;

  /// Takes a letter of a member; one that has done its work before is taken, too. False, and
  /// ignored, if it cannot be read, does not fit, or comes too early to be kept.
  virtual bool receive(RobotId from, std::span<const std::uint8_t> bytes) = 0;
  /// True if advance() has something to do; also at the very beginning.
  [[nodiscard]] virtual bool ready() const = 0;
  /// One piece of work, the letters that it leads to. Throws std::exception if the graph of the
  /// team cannot be solved; the session is over then, and poses() hold.
  [[nodiscard]] virtual std::vector<SolverLetter> advance() = 0;
  [[nodiscard]] virtual bool done() const = 0;

  /// Own poses, in the session's frame, with the lowest cost that the team has agreed on: the start
  /// before there are better ones.
  [[nodiscard]] virtual const std::vector<SE3>& poses() const = 0;
  [[nodiscard]] virtual SolverState state() const = 0;
  /// The closures that this robot weighs, as things stand; empty if the solver rejects none.
  [[nodiscard]] virtual ClosureVerdicts verdicts() const = 0;
  /// SessionGraph::noise with the cycles that were counted in this session.
  [[nodiscard]] virtual ClosureNoiseRecord noise() const { return {}; }
};

}  // namespace km
