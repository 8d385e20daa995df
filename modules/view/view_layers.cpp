#include "modules/view/view_layers.hpp"

#include <utility>

#include "modules/view/view_content.hpp"

namespace km {

void ViewLayers::set(std::size_t layer, std::function<std::optional<ViewContent>()> newest) {
  layers_[layer].newest = std::move(newest);
  layers_[layer].is_new = true;
}

void ViewLayers::add(std::shared_ptr<const ObjectList> objects) {
  set(0, [objects = std::move(objects)] { return view_objects(*objects); });
}

void ViewLayers::add(std::shared_ptr<const OccupancyGrid> map) {
  set(1, [map = std::move(map)] { return view_raster(*map); });
}

void ViewLayers::begin_again() {
  due_s_ = 0.0;
  for (Layer& layer : layers_) {
    layer.is_new = layer.newest != nullptr;
    layer.sent.clear();
  }
}

std::optional<ViewContent> ViewLayers::next(double now_s) {
  if (now_s < due_s_) return std::nullopt;
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    Layer& layer = layers_[(turn_ + k) % layers_.size()];
    if (!std::exchange(layer.is_new, false)) continue;
    std::optional<ViewContent> content = layer.newest();
    if (!content) continue;
    std::vector<std::uint8_t> bytes = encode_view(*content);
    if (bytes == layer.sent) continue;
    due_s_ = now_s + static_cast<double>(bytes.size()) / bytes_per_s_;
    layer.sent = std::move(bytes);
    turn_ += k + 1;
    return content;
  }
  return std::nullopt;
}

}  // namespace km
