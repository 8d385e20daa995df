#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "modules/core/map/label_palette.hpp"

namespace km {

/// The votes on the label of one voxel: for each label l the sum n_l of the weights of its
/// observations.
///
/// An observation of label m has the likelihood P(m | label l) = c for l = m and (1 - c) / (L - 1)
/// for each other of the L classes. From a uniform prior, observations of weights w_m, with
/// likelihoods to the power of w_m, give
///   P(l | all) ~ exp(delta n_l),  delta = log(c (L - 1) / (1 - c)),
/// so that the most probable label is the one with most votes, for any c above 1 / L.
///
/// A voxel has the sums in 8 bytes, for the four labels with most votes, in eighths of weight.
/// Exact while no more than four labels were seen. The votes of a fifth label are subtracted from
/// each of the four, and the fifth takes an entry that becomes free (Misra and Gries, "Finding
/// Repeated Elements", 1982). A label with more than a fifth of all votes is therefore never lost.
/// Beyond 255 votes all are halved, so that old ones fade.
class VoxelLabels {
 public:
  static constexpr unsigned kVotesPerWeight = 8;

  /// Votes of an observation of weight in [0, 1]: rounded, at least one.
  [[nodiscard]] static unsigned votes_of(float weight) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): lround takes longer, and nothing is negative
    const auto votes = static_cast<unsigned>(weight * static_cast<float>(kVotesPerWeight) + 0.5F);
    return votes > 0 ? votes : 1;
  }

  /// Preconditions: a known label (not 0), 1 to kVotesPerWeight votes.
  void observe(LabelId label, unsigned votes) {
    if (ids_[0] == label && votes_[0] + votes <= 255) {
      votes_[0] = static_cast<std::uint8_t>(votes_[0] + votes);
    } else {
      observe_other(label, votes);
    }
  }

  /// Adds the votes of another vertex on the same surface by the rules of observe(). Beyond 255
  /// votes both are halved.
  void add(VoxelLabels other);

  /// The label with most votes, the earlier of equal ones; 0 without votes.
  [[nodiscard]] LabelId best() const { return ids_[0]; }

  /// Sum of the weights n_l kept for a label.
  [[nodiscard]] double weight_of(LabelId label) const;

 private:
  static constexpr std::size_t kPlaces = 4;

  void observe_other(LabelId label, unsigned votes);
  void halve();

  std::array<LabelId, kPlaces> ids_ = {};         // labels by descending votes; 0: free entry
  std::array<std::uint8_t, kPlaces> votes_ = {};  // votes of ids_; 0: free entry
};

}  // namespace km
