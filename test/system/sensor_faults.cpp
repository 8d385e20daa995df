#include "test/system/sensor_faults.hpp"

#include <algorithm>
#include <random>

namespace km {
namespace {

using Corruption = std::function<void(EurocCopy&, Stamp, Stamp)>;

template <typename Item, typename Change>
void for_each_within(std::vector<Item>& items, Stamp begin, Stamp end, Change change) {
  for (Item& item : items)
    if (item.stamp >= begin && item.stamp < end) change(item);
}

template <typename Item>
void erase_within(std::vector<Item>& items, Stamp begin, Stamp end) {
  std::erase_if(items, [&](const Item& item) { return item.stamp >= begin && item.stamp < end; });
}

Corruption uniform(std::vector<std::size_t> cameras, double level) {
  return [cameras = std::move(cameras), level](EurocCopy& copy, Stamp begin, Stamp end) {
    for (const std::size_t c : cameras)
      for_each_within(copy.cameras[c], begin, end, [&](EurocCopy::Image& image) {
        image.gain = 0.0;
        image.level = level;
      });
  };
}

// Frames of both cameras, by number.
Corruption drop_frames(std::function<bool(std::size_t)> is_lost) {
  return [is_lost = std::move(is_lost)](EurocCopy& copy, Stamp begin, Stamp end) {
    std::vector<Stamp> lost;
    for (std::size_t k = 0; k < copy.cameras[0].size(); ++k) {
      const Stamp stamp = copy.cameras[0][k].stamp;
      if (stamp >= begin && stamp < end && is_lost(k)) lost.push_back(stamp);
    }
    for (auto& images : copy.cameras)
      std::erase_if(images,
                    [&](const auto& image) { return std::ranges::count(lost, image.stamp) > 0; });
  };
}

Corruption drop_at_random(double share) {
  return drop_frames([share, rng = std::mt19937(3)](std::size_t /*frame*/) mutable {
    return std::uniform_real_distribution<double>()(rng) < share;
  });
}

// A second of every three.
Corruption drop_bursts() {
  return [](EurocCopy& copy, Stamp begin, Stamp end) {
    for (Stamp at = begin; at < end; at += nanoseconds(3.0))
      for (auto& images : copy.cameras) erase_within(images, at, at + nanoseconds(1.0));
  };
}

void drop_samples(EurocCopy& copy, Stamp begin, Stamp end) {
  erase_within(copy.samples, begin, end);
}

void drop_everything(EurocCopy& copy, Stamp begin, Stamp end) {
  drop_samples(copy, begin, end);
  for (auto& images : copy.cameras) erase_within(images, begin, end);
}

Corruption move_samples(double by_s) {
  return [by_s](EurocCopy& copy, Stamp begin, Stamp end) {
    for_each_within(copy.samples, begin, end,
                    [&](EurocCopy::Sample& sample) { sample.stamp += nanoseconds(by_s); });
  };
}

// Overexposed pixels become white.
void jump_exposure(EurocCopy& copy, Stamp begin, Stamp end) {
  for (auto& images : copy.cameras)
    for_each_within(images, begin, end, [&](EurocCopy::Image& image) {
      image.gain = (image.stamp - begin) / nanoseconds(1.0) % 2 == 0 ? 0.4 : 2.5;
    });
}

void late_right(EurocCopy& copy, Stamp /*begin*/, Stamp /*end*/) {
  for (EurocCopy::Image& image : copy.cameras[1]) image.stamp += nanoseconds(0.002);
}

void late_cameras(EurocCopy& copy, Stamp begin, Stamp end) {
  for (auto& images : copy.cameras) erase_within(images, begin, end);
}

}  // namespace

std::vector<SensorFault> sensor_faults() {
  const std::string lost = "vision lost since", gap = "gaps between inertial samples",
                    unordered = "stamps out of order";
  constexpr double kBlind5_m = 1.0, kBlind15_m = 10.0;  // by inertial sensing alone
  constexpr double kRestart2_m = 3.0;                   // distance of the flight during the restart
  const auto blind = [&](const std::string& name, double lasts_s, Corruption corrupt) {
    return SensorFault{.name = name,
                       .lasts_s = lasts_s,
                       .corrupt = std::move(corrupt),
                       .event = lost,
                       .bound_m = lasts_s > 5.0 ? kBlind15_m : kBlind5_m,
                       .is_blind = true};
  };
  return {
      {"nothing", 0.0, [](EurocCopy&, Stamp, Stamp) {}},
      blind("no light", 5.0, uniform({0, 1}, 0.0)),
      blind("no features", 5.0, uniform({0, 1}, 128.0)),
      blind("left lens covered", 5.0, uniform({0}, 6.0)),
      {"right lens covered", 5.0, uniform({1}, 6.0)},
      blind("no light", 15.0, uniform({0, 1}, 0.0)),
      {"one frame in ten lost", 10.0, drop_at_random(0.1)},
      {"bursts of 1 s without frames", 9.0, drop_bursts()},
      {"no samples", 0.1, drop_samples, gap},
      {"no samples", 0.5, drop_samples, gap},
      {"no samples", 2.0, drop_samples, gap},
      {"samples 1 s ahead", 0.2, move_samples(1.0), unordered},
      {"samples 1 s back", 0.2, move_samples(-1.0), unordered},
      {"right images 2 ms late", 10.0, late_right, "2.00 ms after"},
      {"exposure jumps", 10.0, jump_exposure},
      {.name = "cameras 10 s late", .lasts_s = 10.0, .corrupt = late_cameras, .is_at_start = true},
      {"drivers restart", 2.0, drop_everything, gap, kRestart2_m, true},
  };
}

}  // namespace km
