#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/closure_noise.hpp"

namespace km {

/// Message of a solver to one other member. Only solvers know the encoding of `bytes`. Their number
/// is that on the network.
struct SolverMessage {
  RobotId to = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

/// Progress of the team, as this member knows it.
struct SolverState {
  std::uint32_t round = 0;   ///< Number of complete rounds of the team.
  double cost = 0.0;         ///< Team cost at poses(), with the weights of the closures there.
  double gradient = 0.0;     ///< Newton: sqrt(g^T H^-1 g); rbcd: norm of the Riemannian gradient.
  double noise_scale = 1.0;  ///< Noise scale of the closures, estimated by the team.
  double odometry_noise = 1.0;  ///< This robot: likely_odometry_noise() [ratio].
  double barc = 0.0;  ///< Largest residual of a closure that is kept [sigma]; 0: none is rejected.
  bool deferred = false;  ///< A second look is due: closures were deferred, or are possible.
  bool failed = false;    ///< The graph of the team could not be solved.
};

/// The part of one robot in solving the graph of a session. Messages may arrive early, late,
/// repeatedly and in any order. None is lost permanently, because senders repeat messages that were
/// not taken. Deterministic; not thread-safe.
class MemberSolver {
 public:
  virtual ~MemberSolver() = default;

  /// Takes a message of a member. It also takes messages that are no longer needed. False, without
  /// effect, if the message cannot be decoded, does not fit, or arrives too early to be kept.
  virtual bool receive(RobotId from, std::span<const std::uint8_t> bytes) = 0;
  /// True if advance() has something to do; also at the very beginning.
  [[nodiscard]] virtual bool ready() const = 0;
  /// Does one piece of work and returns the resulting messages. Throws std::exception if the graph
  /// of the team cannot be solved. The session is then over, and poses() remain valid.
  [[nodiscard]] virtual std::vector<SolverMessage> advance() = 0;
  [[nodiscard]] virtual bool done() const = 0;

  /// Own poses in the frame of the session, as the team has last accepted them; at first the start.
  [[nodiscard]] virtual const std::vector<SE3>& poses() const = 0;
  /// Covariances of poses() relative to the origin of the session, once it is done, as tangent
  /// vectors [rotation; translation] at the pose (see core/data/covariance.hpp). Empty if the
  /// solver computes none.
  [[nodiscard]] virtual std::vector<Matrix6> covariances() const { return {}; }
  [[nodiscard]] virtual SolverState state() const = 0;
  /// Present verdicts on the closures that this robot weighs; empty if the solver rejects none.
  [[nodiscard]] virtual ClosureVerdicts verdicts() const = 0;
  /// The noise of closures, as far as this robot knows it.
  [[nodiscard]] virtual ClosureNoiseRecord noise() const { return {}; }
};

}  // namespace km
