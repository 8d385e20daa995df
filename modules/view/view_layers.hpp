#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "modules/core/map/occupancy_grid.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Chooses the next update for viewers from the objects and the 2D map of a robot. The newest of
/// each is sent, in turn, if it has changed since it was sent. They share a rate. Inputs are
/// converted only when they are sent. Not thread-safe.
class ViewLayers {
 public:
  explicit ViewLayers(double bytes_per_s) : bytes_per_s_(bytes_per_s) {}

  void add(std::shared_ptr<const ObjectList> objects);
  void add(std::shared_ptr<const OccupancyGrid> map);

  /// A viewer has appeared: sends the newest of each again.
  void begin_again();

  /// The update to send at `now_s` [s], by any clock that does not go backwards. The update counts
  /// as sent. nullopt if no update is due.
  [[nodiscard]] std::optional<ViewContent> next(double now_s);

 private:
  struct Layer {
    std::function<std::optional<ViewContent>()> newest;  // conversion of the newest input
    bool is_new = false;                                 // true if it was not considered yet
    std::vector<std::uint8_t> sent;                      // bytes of the last update
  };
  void set(std::size_t layer, std::function<std::optional<ViewContent>()> newest);

  double bytes_per_s_;
  std::array<Layer, 2> layers_;
  std::size_t turn_ = 0;  // layer that is considered first
  double due_s_ = 0.0;
};

}  // namespace km
