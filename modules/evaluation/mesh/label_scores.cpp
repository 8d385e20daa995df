#include "modules/evaluation/mesh/label_scores.hpp"

#include <limits>

namespace km {
namespace {

double ratio(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

double LabelScore::accuracy() const {
  return ratio(right, points());
}

double LabelScore::accuracy_of_known() const {
  return ratio(right, right + wrong);
}

void LabelConfusion::add(LabelId truth, LabelId estimate) {
  ++counts_[index(truth, estimate)];
}

void LabelConfusion::add(const LabelConfusion& other) {
  for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
}

std::vector<LabelScore> LabelConfusion::by_class() const {
  std::vector<LabelScore> scores;
  for (std::size_t truth = 1; truth < kIds; ++truth) {
    LabelScore score;
    score.id = static_cast<LabelId>(truth);
    for (std::size_t estimate = 0; estimate < kIds; ++estimate) {
      const std::size_t points = counts_[truth * kIds + estimate];
      (estimate == truth ? score.right : estimate == 0 ? score.unknown : score.wrong) += points;
    }
    if (score.points() > 0) scores.push_back(score);
  }
  return scores;
}

LabelScore LabelConfusion::total() const {
  LabelScore total;
  for (const LabelScore& score : by_class()) {
    total.right += score.right;
    total.wrong += score.wrong;
    total.unknown += score.unknown;
  }
  return total;
}

}  // namespace km
