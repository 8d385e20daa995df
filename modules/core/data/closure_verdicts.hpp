#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/data/pose_graph.hpp"

namespace km {

struct WeighedClosure {
  ClosureId id;
  bool kept = true;
};

/// Results of graduated non-convexity for a robot's closures of one session. The latest result of
/// each closure counts.
struct ClosureVerdicts {
  std::vector<WeighedClosure> closures;

  [[nodiscard]] std::size_t rejected() const {
    return static_cast<std::size_t>(
        std::count_if(closures.begin(), closures.end(), [](const auto& c) { return !c.kept; }));
  }
};

/// Status of a closure candidate for viewers. kVerified means that no inlier set contains the
/// closure, or that none is known yet.
enum class ClosureStatus : std::uint8_t { kCandidate, kVerified, kRejected, kKept };

/// Decision on a closure of this robot.
struct ClosureJudgement {
  ClosureId id;
  bool selected = false;   ///< The newest inlier set of its robots contains it.
  bool overruled = false;  ///< The optimiser rejects it.

  [[nodiscard]] bool is_inlier() const { return selected && !overruled; }
  bool operator==(const ClosureJudgement&) const = default;
};

/// Judgements that have changed; the newest of each closure counts.
struct ClosureJudgements {
  std::vector<ClosureJudgement> closures;
};

}  // namespace km
