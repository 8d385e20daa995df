#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/road.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"

// Stereo pairs per second of all stages except for the encoding of files, on two threads, and the
// time of each stage. Poses: along the first route of a city, or turning in the middle of a room.

namespace km {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

SE3 pose_at(const Eigen::Vector3d& position, double heading) {
  return make_pose(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                   position);
}

std::vector<SE3> poses_in(const World& world, int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {
    if (world.routes.empty()) {
      poses.push_back(pose_at(world.flight_volume.center(), 6.2832 * i / count));
      continue;
    }
    const RoutePath path(world.routes[0], 5.0);
    const RoutePath::Point point = path.at(path.length_m() * (i + 0.5) / count);
    const double ground = world.ground_height(point.position.x(), point.position.y());
    poses.push_back(pose_at({point.position.x(), point.position.y(), ground + 1.5},
                            std::atan2(point.tangent.y(), point.tangent.x())));
  }
  return poses;
}

Shot driving_shot() {
  Shot shot;
  shot.exposure = {1.0, 0.005};
  shot.body_velocity << 0.0, 0.0, 0.2, 8.0, 0.0, 0.0;
  return shot;
}

struct RenderingCamera {
  PixelRays rays;
  SensorEffects effects;

  explicit RenderingCamera(const Camera& camera) : rays(camera), effects(rays, {}) {}
};

std::size_t develop_pair(const Renderer& renderer, const std::array<RenderingCamera, 2>& cameras,
                         const SE3& T_world_body) {
  const Shot shot = driving_shot();
  std::size_t bytes = 0;
  for (const RenderingCamera& camera : cameras) {
    const RenderedView view =
        renderer.render(camera.rays, T_world_body, camera.effects.request(false));
    bytes += camera.effects.gray(view, shot).pixels.size();
  }
  return bytes;
}

// Threads take the poses in turns.
double pairs_per_second(const Renderer& renderer, const std::array<RenderingCamera, 2>& cameras,
                        const std::vector<SE3>& poses, std::size_t threads) {
  const Clock::time_point start = Clock::now();
  std::vector<std::thread> workers;
  for (std::size_t t = 0; t < threads; ++t)
    workers.emplace_back([&, t] {
      for (std::size_t i = t; i < poses.size(); i += threads)
        (void)develop_pair(renderer, cameras, poses[i]);
    });
  for (std::thread& worker : workers) worker.join();
  return static_cast<double>(poses.size()) / seconds_since(start);
}

template <typename Function>
double mean_ms(const std::vector<SE3>& poses, const Function& function) {
  const Clock::time_point start = Clock::now();
  for (const SE3& T_world_body : poses) function(T_world_body);
  return 1e3 * seconds_since(start) / static_cast<double>(poses.size());
}

void print_stages(const World& world, const Renderer& renderer, const RenderingCamera& camera,
                  const std::vector<SE3>& poses) {
  const Renderer unshadowed(world, {1, false});
  const Renderer coarse(world, {1, true});
  const auto render = [&](const Renderer& with, const RenderRequest& request) {
    return mean_ms(poses, [&](const SE3& T) { (void)with.render(camera.rays, T, request); });
  };
  const double rays = render(unshadowed, {false, false, true, false});
  const double shading = render(unshadowed, {});
  const double shadows = render(coarse, {});
  const double edges = render(renderer, {});
  const RenderedView view = renderer.render(camera.rays, poses[0], camera.effects.request(false));
  const Shot shot = driving_shot();
  const double develop = mean_ms(poses, [&](const SE3&) { (void)camera.effects.gray(view, shot); });
  const double pixels = static_cast<double>(view.radiance.size());
  std::printf(
      "  one view, one thread [ms]: primary rays %.1f (%.0f million/s), shading %.1f, "
      "shadows %.1f, edges %.1f, development %.1f\n",
      rays, 1e-3 * pixels / rays, shading - rays, shadows - shading, edges - shadows, develop);
}

void run(const World& world) {
  const Clock::time_point start = Clock::now();
  const Renderer renderer(world);
  std::printf("%s: %zu triangles, %.1f s to prepare\n", world.name.c_str(),
              world.mesh.triangles.size(), seconds_since(start));
  for (const int shrink : {1, 2}) {
    const StereoRig rig = default_rig(RigKind::kVehicle, 752 / shrink, 480 / shrink).stereo;
    const std::array<RenderingCamera, 2> cameras = {RenderingCamera(rig.cameras[0]),
                                                    RenderingCamera(rig.cameras[1])};
    const std::vector<SE3> poses = poses_in(world, 12);
    std::vector<double> rates;
    for (int i = 0; i < 5; ++i) rates.push_back(pairs_per_second(renderer, cameras, poses, 2));
    std::sort(rates.begin(), rates.end());
    std::printf("%d x %d: %.1f stereo pairs a second on two threads (%.1f to %.1f)\n",
                rig.cameras[0].width, rig.cameras[0].height, rates[2], rates.front(), rates.back());
    print_stages(world, renderer, cameras[0], poses);
  }
}

TEST_CASE("Stereo pairs per second in the city, the camp and the Vicon room", "[!benchmark]") {
  run(make_city(1));
  run(make_camp(1));
  run(make_vicon_room(1));
}

}  // namespace
}  // namespace km
