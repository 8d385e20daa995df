"""Views of recordings with known poses: images, points of the surface they show, and which of them share a surface.

A recording is one of
  world PATH     a folder of kimera_multi_simulate with --depth --ideal-depth
  euroc PATH     an ASL folder with stereo images and the truth, or one with the folder `keyframes`
  kitti PATH     a sequence of KITTI's odometry benchmark
  rgbd PATH      a sequence of 7-Scenes, as frame-NNNNNN.color.jpg, .depth.png and poses.txt
Several recordings joined by "+" are one place in several lights: their poses share one frame.
"""
import csv
import dataclasses
import pathlib
import re

import numpy as np
from PIL import Image

GRID = (16, 12)  # points per image whose surface is looked up
SAME, OTHER = 0.25, 0.04  # shared surface from which views show one place, and below which they show two
DEPTH_TOLERANCE = 0.08  # share of the depth within which two views see one surface


@dataclasses.dataclass
class Camera:
    f: np.ndarray  # fx, fy [px]
    c: np.ndarray  # principal point [px]
    size: tuple  # width, height [px]
    distortion: np.ndarray  # k1, k2, p1, p2
    T_body_cam: np.ndarray

    def project(self, points):
        """Pixels of points (..., 3) in the camera's frame with positive depth."""
        x, y = points[..., 0] / points[..., 2], points[..., 1] / points[..., 2]
        k1, k2, p1, p2 = self.distortion
        r2 = np.minimum(x * x + y * y, 2.0)  # beyond it the polynomial folds back
        radial = 1 + k1 * r2 + k2 * r2 * r2
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.stack([u, v], -1) * self.f + self.c

    def unproject(self, pixels):
        """Points at depth 1 that project to the pixels, by fixed-point iteration."""
        target = (pixels - self.c) / self.f
        xy = target.copy()
        for _ in range(20):
            ones = np.concatenate([xy, np.ones_like(xy[..., :1])], -1)
            xy = xy + target - (self.project(ones) - self.c) / self.f
        return np.concatenate([xy, np.ones_like(xy[..., :1])], -1)

    def grid(self):
        u = (np.arange(GRID[0]) + 0.5) * self.size[0] / GRID[0]
        v = (np.arange(GRID[1]) + 0.5) * self.size[1] / GRID[1]
        return np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)


@dataclasses.dataclass
class View:
    image: pathlib.Path
    camera: Camera
    T_world_cam: np.ndarray
    points: np.ndarray  # (n, 3) in the world [m]: where grid points of known depth lie
    depth: np.ndarray  # [m], 0: unknown; None without a depth image
    robot: str = ""


def rotation(q_wxyz):
    w, x, y, z = np.asarray(q_wxyz, float) / np.linalg.norm(q_wxyz)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def transform(R, t):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T


def apply(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def read_rows(path, delimiter=","):
    with open(path) as file:
        return [row for row in csv.reader(file, delimiter=delimiter) if row and row[0][0] not in "#t"]


def read_camera(path):
    text = path.read_text()
    numbers = lambda key: [float(x) for x in
                           re.search(key + r":\s*\[([^\]]*)\]", text).group(1).replace(",", " ").split()]
    fx, fy, cx, cy = numbers("intrinsics")
    return Camera(np.array([fx, fy]), np.array([cx, cy]), tuple(int(x) for x in numbers("resolution")),
                  np.array(numbers("distortion_coefficients")), np.array(numbers("data")).reshape(4, 4))


def read_truth(folder):
    """Stamps [ns] and poses of the body of an ASL folder."""
    tum = folder / "groundtruth_tum.txt"
    rows = read_rows(tum, " ") if tum.exists() else read_rows(folder / "data.csv")
    values = np.array([[float(x) for x in row[1:8]] for row in rows])
    stamps = np.array([int(float(row[0]) * 1e9) if tum.exists() else int(row[0]) for row in rows])
    quaternions = values[:, [6, 3, 4, 5]] if tum.exists() else values[:, 3:7]
    return stamps, [transform(rotation(q), t) for q, t in zip(quaternions, values[:, :3])]


def read_gray(path):
    return np.asarray(Image.open(path).convert("L"), np.float32)


def view_with_depth(image, camera, T_world_cam, depth):
    pixels = camera.grid()
    scale = depth.shape[1] / camera.size[0]
    z = depth[tuple((pixels * scale).astype(int).T[::-1])]
    known = z > 0
    points = camera.unproject(pixels[known]) * z[known, None]
    return View(image, camera, T_world_cam, apply(T_world_cam, points), depth)


def view_with_stereo(left, right, cameras, T_world_cam):
    """Depth of grid points by normalised correlation of patches along the epipolar line."""
    a, b = read_gray(left), read_gray(right)
    T_right_left = np.linalg.inv(cameras[1].T_body_cam) @ cameras[0].T_body_cam
    offsets = np.stack(np.meshgrid(np.arange(-7, 8), np.arange(-7, 8)), -1).reshape(-1, 2)

    def patches(image, pixels):
        at = np.rint(pixels[..., None, :] + offsets).astype(int)
        patch = image[np.clip(at[..., 1], 0, image.shape[0] - 1), np.clip(at[..., 0], 0, image.shape[1] - 1)]
        patch = patch - patch.mean(-1, keepdims=True)
        deviation = np.sqrt((patch**2).mean(-1, keepdims=True))
        return patch / np.maximum(deviation, 1e-6), deviation[..., 0]

    pixels = cameras[0].grid()
    baseline_px = np.linalg.norm(T_right_left[:3, 3]) * cameras[0].f[0]
    depths = baseline_px / np.linspace(0.5, baseline_px / 0.6, 120)
    bearings = cameras[0].unproject(pixels)
    found = cameras[1].project(apply(T_right_left, bearings[:, None] * depths[:, None]))
    own, deviation = patches(a, pixels)
    correlation = (own[:, None] * patches(b, found)[0]).mean(-1)
    best = correlation.argmax(1)
    good = (correlation.max(1) > 0.8) & (deviation > 4)
    return View(left, cameras[0], T_world_cam,
                apply(T_world_cam, bearings[good] * depths[best[good], None]), None)


def world_views(path):
    for robot in sorted(path.glob("robot*/mav0")):
        camera = read_camera(robot / "cam0/sensor.yaml")
        stamps, poses = read_truth(robot / "state_groundtruth_estimate0")
        depths = {row[0]: row[1] for row in read_rows(robot / "depth0/data.csv")}
        for stamp, name in read_rows(robot / "cam0/data.csv"):
            nearest = np.abs(stamps - int(stamp)).argmin()
            if stamp not in depths or abs(stamps[nearest] - int(stamp)) > 1e7:
                continue
            depth = np.asarray(Image.open(robot / "depth0/data" / depths[stamp]), np.float32) / 1000
            step = max(1, camera.size[1] // 120)
            view = view_with_depth(robot / "cam0/data" / name, camera, poses[nearest] @ camera.T_body_cam,
                                   depth[::step, ::step])
            view.robot = robot.parent.name
            yield view


def euroc_views(path):
    cameras = [read_camera(path / f"mav0/cam{i}/sensor.yaml") for i in (0, 1)]
    stamps, poses = read_truth(path / "mav0/state_groundtruth_estimate0")
    keyframes = path / "keyframes"
    if keyframes.exists():
        pairs = [(row[0], keyframes / row[1], keyframes / row[2]) for row in read_rows(keyframes / "pairs.csv")]
    else:
        pairs = [(row[0], path / "mav0/cam0/data" / row[1], path / "mav0/cam1/data" / row[1])
                 for row in read_rows(path / "mav0/cam0/data.csv")]
    for stamp, left, right in pairs:
        nearest = np.abs(stamps - int(stamp)).argmin()
        if abs(stamps[nearest] - int(stamp)) <= 5e7:
            yield view_with_stereo(left, right, cameras, poses[nearest] @ cameras[0].T_body_cam)


def kitti_views(path):
    P = {row[0]: np.array([float(x) for x in row[1:13]]).reshape(3, 4)
         for row in (line.split() for line in (path / "calib.txt").read_text().splitlines()) if row}
    P0, P1 = P["P0:"], P["P1:"]
    images = sorted((path / "image_0").iterdir())
    shift = transform(np.eye(3), [-P1[0, 3] / P1[0, 0], 0, 0])
    cameras = [Camera(P0[[0, 1], [0, 1]], P0[:2, 2], Image.open(images[0]).size, np.zeros(4), T)
               for T in (np.eye(4), shift)]
    for image, row in zip(images, (path / "poses.txt").read_text().splitlines()):
        T = np.vstack([np.array([float(x) for x in row.split()]).reshape(3, 4), [0, 0, 0, 1]])
        yield view_with_stereo(image, path / "image_1" / image.name, cameras, T)


def rgbd_views(path):
    K = np.loadtxt(path / "camera-intrinsics.txt")
    camera = Camera(K[[0, 1], [0, 1]], K[:2, 2], (640, 480), np.zeros(4), np.eye(4))
    for row in np.loadtxt(path / "poses.txt"):
        image = path / f"frame-{int(row[0]):06d}.color.jpg"
        if image.exists():
            depth = np.asarray(Image.open(path / f"frame-{int(row[0]):06d}.depth.png"), np.float32) / 1000
            depth[depth > 60] = 0
            yield view_with_depth(image, camera, np.vstack([row[1:].reshape(3, 4), [0, 0, 0, 1]]), depth[::4, ::4])


def read_views(recording):
    """All views of "KIND PATH" or "KIND PATH+PATH"."""
    kind, paths = recording.split(" ", 1)
    readers = {"world": world_views, "euroc": euroc_views, "kitti": kitti_views, "rgbd": rgbd_views}
    return [view for path in paths.split("+") for view in readers[kind](pathlib.Path(path))]


def is_visible(view, points):
    """Which points of the world `view` sees."""
    points = apply(np.linalg.inv(view.T_world_cam), points)
    seen = (points[:, 2] > 0.1) & np.all(np.abs(points[:, :2]) < 2.0 * points[:, 2:], 1)
    pixels = view.camera.project(points[seen])
    inside = np.all((pixels >= 0) & (pixels < np.array(view.camera.size)), 1)
    if view.depth is not None:
        scale = view.depth.shape[1] / view.camera.size[0]
        at = np.clip((pixels * scale).astype(int), 0, np.array(view.depth.shape[::-1]) - 1)
        depth, z = view.depth[at[:, 1], at[:, 0]], points[seen, 2]
        inside &= (depth > 0) & (np.abs(depth - z) < DEPTH_TOLERANCE * z + 0.1)
    seen[seen] = inside
    return seen


def overlaps(views):
    """Matrix of the surface that two views share: the smaller of the two visible shares."""
    points = np.concatenate([view.points for view in views])
    owner = np.repeat(np.arange(len(views)), [len(view.points) for view in views])
    counts = np.maximum(np.bincount(owner, minlength=len(views)), 12)  # fewer points say little
    shares = np.array([np.bincount(owner, is_visible(view, points), len(views)) / counts for view in views])
    return np.minimum(shares, shares.T).astype(np.float32)


def angles_deg(views):
    """Matrix of the angles between the views' orientations [deg]."""
    R = np.array([view.T_world_cam[:3, :3] for view in views])
    trace = np.einsum("iab,jab->ij", R, R)
    return np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1)))
