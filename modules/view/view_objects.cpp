#include "modules/view/view_objects.hpp"

#include <algorithm>
#include <functional>

#include "modules/view/view_update.hpp"

namespace km {
namespace {

constexpr std::size_t kObjectsHead_bytes = 16;

// Upper bound on the bytes of an object in an update.
std::size_t bytes_of(const MapObject& object) {
  constexpr std::size_t kFixed = 1 + 7 * sizeof(float) + 3, kRobot = 3;
  return kFixed + kRobot * object.robots.size();
}

}  // namespace

ViewObjects view_objects(const ObjectList& list) {
  std::vector<const MapObject*> all;
  for (const MapObject& object : list.objects) all.push_back(&object);
  std::ranges::stable_sort(all, std::greater{},
                           [](const MapObject* object) { return object->box.volume_m3(); });
  ViewObjects view{.anchor = list.anchor};
  std::size_t bytes = kObjectsHead_bytes;
  for (const MapObject* const object : all) {
    bytes += bytes_of(*object);
    if (bytes > kMaxViewBytes) break;
    const ObjectBox& box = object->box;
    view.objects.push_back({object->label, box.center.cast<float>(),
                            static_cast<float>(box.yaw_rad), box.size_m.cast<float>(),
                            object->robots});
  }
  view.left_out = static_cast<std::uint32_t>(all.size() - view.objects.size());
  return view;
}

}  // namespace km
