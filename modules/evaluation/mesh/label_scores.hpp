#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/label_palette.hpp"

namespace km {

/// How the estimate labels the points of one true class.
struct LabelScore {
  LabelId id = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;    ///< Another known class.
  std::size_t unknown = 0;  ///< Labelled 0.

  [[nodiscard]] std::size_t points() const { return right + wrong + unknown; }

  /// Share of right labels among all points, unknown included, or among the known only. NaN for
  /// none.
  [[nodiscard]] double accuracy() const;
  [[nodiscard]] double accuracy_of_known() const;
};

/// Counts pairs of a true label and the one estimated in its place.
class LabelConfusion {
 public:
  void add(LabelId truth, LabelId estimate);
  void add(const LabelConfusion& other);

  [[nodiscard]] std::uint64_t count(LabelId truth, LabelId estimate) const {
    return counts_[index(truth, estimate)];
  }

  /// One entry per true class that occurs, by id; points whose true class is unknown are not
  /// judged.
  [[nodiscard]] std::vector<LabelScore> by_class() const;

  /// All classes together, with id 0.
  [[nodiscard]] LabelScore total() const;

 private:
  static constexpr std::size_t kIds = 256;
  static std::size_t index(LabelId truth, LabelId estimate) { return truth * kIds + estimate; }

  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(kIds * kIds, 0);
};

}  // namespace km
