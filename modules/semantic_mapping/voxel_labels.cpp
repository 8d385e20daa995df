#include "modules/semantic_mapping/voxel_labels.hpp"

#include <algorithm>
#include <utility>

namespace km {

void VoxelLabels::observe_other(LabelId label, unsigned votes) {
  std::size_t place = 0;
  while (place < kPlaces && ids_[place] != label && votes_[place] > 0) ++place;
  if (place == kPlaces) {  // a fifth label
    const unsigned paid = std::min<unsigned>(votes, votes_.back());
    for (std::size_t i = 0; i < kPlaces; ++i) {
      votes_[i] = static_cast<std::uint8_t>(votes_[i] - paid);
      if (votes_[i] == 0) ids_[i] = 0;
    }
    if (votes > paid) observe_other(label, votes - paid);
    return;
  }
  if (votes_[place] + votes > 255) halve();
  ids_[place] = label;
  votes_[place] = static_cast<std::uint8_t>(votes_[place] + votes);
  for (; place > 0 && votes_[place] > votes_[place - 1]; --place) {
    std::swap(votes_[place], votes_[place - 1]);
    std::swap(ids_[place], ids_[place - 1]);
  }
}

void VoxelLabels::halve() {
  for (std::size_t i = 0; i < kPlaces; ++i) {
    votes_[i] = static_cast<std::uint8_t>(votes_[i] / 2);
    if (votes_[i] == 0) ids_[i] = 0;
  }
}

void VoxelLabels::add(VoxelLabels other) {
  bool too_many = false;
  for (std::size_t i = 0; i < kPlaces; ++i)
    for (std::size_t j = 0; j < kPlaces; ++j)
      too_many |= ids_[i] == other.ids_[j] && votes_[i] + other.votes_[j] > 255;
  if (too_many) {
    halve();
    other.halve();
  }
  for (std::size_t i = 0; i < kPlaces && other.votes_[i] > 0; ++i)
    observe_other(other.ids_[i], other.votes_[i]);
}

double VoxelLabels::weight_of(LabelId label) const {
  for (std::size_t i = 0; i < kPlaces; ++i)
    if (ids_[i] == label && label != 0)
      return static_cast<double>(votes_[i]) / static_cast<double>(kVotesPerWeight);
  return 0.0;
}

}  // namespace km
