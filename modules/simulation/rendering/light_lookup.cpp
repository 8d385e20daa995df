#include <algorithm>
#include <array>
#include <cstring>

#include "modules/simulation/rendering/light_volume.hpp"

namespace km {
namespace {

// Byte `shift` / 8 of a word.
float byte_of(std::uint32_t word, std::uint32_t shift) {
  return static_cast<float>(static_cast<std::int32_t>(word >> shift & 0xFFU));
}

// Squares of the normals' components, and which of each axis's two directions they lean to: the
// shift of its byte.
struct Leaning {
  Lanes3 weight;
  BitLanes x, y, z;
};

void lean(const Lanes3& normals, Leaning& leaning) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    leaning.weight.x[i] = normals.x[i] * normals.x[i];
    leaning.weight.y[i] = normals.y[i] * normals.y[i];
    leaning.weight.z[i] = normals.z[i] * normals.z[i];
    leaning.x[i] = normals.x[i] < 0.0F ? 8 : 0;
    leaning.y[i] = normals.y[i] < 0.0F ? 24 : 16;
    leaning.z[i] = normals.z[i] < 0.0F ? 8 : 0;
  }
}

// A sample's bytes of every lane, four to a word.
template <std::size_t kWords>
using SampleWords = std::array<BitLanes, kWords>;

template <std::size_t kWords>
void fetch(const std::array<const std::uint8_t*, kLanes>& low, std::size_t offset,
           SampleWords<kWords>& words) {
  for (std::size_t i = 0; i < kLanes; ++i)
    for (std::size_t k = 0; k < kWords; ++k)
      std::memcpy(&words[k][i], low[i] + offset + 4 * k, sizeof(std::uint32_t));
}

void add_ambient(const BitLanes& word0, const BitLanes& word1, const Lanes& weight,
                 const Leaning& leaning, Lanes& sum) {
  for (std::size_t i = 0; i < kLanes; ++i)
    sum[i] += weight[i] * (leaning.weight.x[i] * byte_of(word0[i], leaning.x[i]) +
                           leaning.weight.y[i] * byte_of(word0[i], leaning.y[i]) +
                           leaning.weight.z[i] * byte_of(word1[i], leaning.z[i]));
}

void add_lamp(const BitLanes& word, std::uint32_t shift, const Lanes& weight, Lanes& sum) {
  for (std::size_t i = 0; i < kLanes; ++i) sum[i] += weight[i] * byte_of(word[i], shift);
}

// Of corner `index` of a cell: bit 0 is x, bit 1 y, bit 2 z.
void corner_weights(std::size_t index, const Lanes3& share, Lanes& weights) {
  const bool x = (index & 1U) != 0U;
  const bool y = (index & 2U) != 0U;
  const bool z = (index & 4U) != 0U;
  for (std::size_t i = 0; i < kLanes; ++i)
    weights[i] = (x ? share.x[i] : 1.0F - share.x[i]) * (y ? share.y[i] : 1.0F - share.y[i]) *
                 (z ? share.z[i] : 1.0F - share.z[i]);
}

}  // namespace

void LightVolume::find_cells(const Lanes3& points, const Lanes3& normals, Cells& cells) const {
  const float lift_m = kLift * cell_m_;
  const float per_cell = per_cell_;
  const Eigen::Vector3f origin = origin_;
  const Eigen::Vector3i bricks = bricks_;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float x = (points.x[i] + lift_m * normals.x[i] - origin.x()) * per_cell;
    const float y = (points.y[i] + lift_m * normals.y[i] - origin.y()) * per_cell;
    const float z = (points.z[i] + lift_m * normals.z[i] - origin.z()) * per_cell;
    const auto ix = static_cast<std::int32_t>(x);
    const auto iy = static_cast<std::int32_t>(y);
    const auto iz = static_cast<std::int32_t>(z);
    const std::int32_t bx = ix / kBrick;
    const std::int32_t by = iy / kBrick;
    const std::int32_t bz = iz / kBrick;
    // Free of branches, so that lanes run side by side.
    const float least = std::min(x, std::min(y, z));
    const std::int32_t spare =
        std::min(bricks.x() - bx, std::min(bricks.y() - by, bricks.z() - bz));
    const std::int32_t place = (bz * bricks.y() + by) * bricks.x() + bx;
    cells.brick[i] = (least >= 0.0F) & (spare > 0) ? place : -1;
    cells.corner[i] =
        ((iz - bz * kBrick) * kSide + (iy - by * kBrick)) * kSide + (ix - bx * kBrick);
    cells.share.x[i] = x - static_cast<float>(ix);
    cells.share.y[i] = y - static_cast<float>(iy);
    cells.share.z[i] = z - static_cast<float>(iz);
  }
}

// Trilinear in the lattice. In direction: the squares of the normal's components weigh the three
// axes it leans to (the ambient cube).
template <std::size_t kWords>
void LightVolume::interpolate(const Cells& cells, const Lanes3& normals, Light& light) const {
  const auto lamps = static_cast<std::size_t>(lamps_);
  std::array<const std::uint8_t*, kLanes> low;
  IntLanes baked;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::int32_t place = cells.brick[i];
    const std::int32_t brick = place < 0 ? -1 : brick_index_[static_cast<std::size_t>(place)];
    baked[i] = brick < 0 ? 0 : 1;
    const std::size_t sample = static_cast<std::size_t>(std::max(brick, 0)) * kBrickSamples +
                               static_cast<std::size_t>(brick < 0 ? 0 : cells.corner[i]);
    low[i] = samples_.data() + sample * 4 * kWords;
  }
  Leaning leaning;
  lean(normals, leaning);
  light.ambient.fill(0.0F);
  for (std::size_t lamp = 0; lamp < lamps; ++lamp) light.lamp_visibility[lamp].fill(0.0F);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t sample =
        (corner & 1U) + (corner >> 1U & 1U) * kSide + (corner >> 2U) * kSide * kSide;
    SampleWords<kWords> words;
    fetch(low, sample * 4 * kWords, words);
    Lanes weights;
    corner_weights(corner, cells.share, weights);
    add_ambient(words[0], words[1], weights, leaning, light.ambient);
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
      const std::size_t byte = kAxisDirections + lamp;
      add_lamp(words[byte / 4], static_cast<std::uint32_t>(8 * (byte % 4)), weights,
               light.lamp_visibility[lamp]);
    }
  }
  for (std::size_t i = 0; i < kLanes; ++i)
    light.ambient[i] = baked[i] != 0 ? ambient_scale_ * light.ambient[i] : open_ambient_;
  for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
    Lanes& visibility = light.lamp_visibility[lamp];
    for (std::size_t i = 0; i < kLanes; ++i)
      visibility[i] = baked[i] != 0 ? visibility[i] / 255.0F : 1.0F;
  }
}

void LightVolume::look_up(const Lanes3& points, const Lanes3& normals, Light& light) const {
  run_wide([&] {
    Cells cells;
    find_cells(points, normals, cells);
    if (sample_bytes_ == kFewLampsBytes) {
      interpolate<kFewLampsBytes / 4>(cells, normals, light);
    } else {
      interpolate<kManyLampsBytes / 4>(cells, normals, light);
    }
  });
}

}  // namespace km
