#!/usr/bin/env python3
"""Fuses a recording's depth images by its true poses with Open3D, for a comparison of maps.

RECORDING is a folder of EuRoC's layout with mav0/depth0, as kimera_multi_simulate writes it. The
mesh has the frame of the true poses, and colours by cam0. Needs python3-open3d and python3-yaml.
"""

import argparse
import bisect
import json
import pathlib
import resource
import statistics
import time

import numpy as np
import open3d as o3d
import yaml


def read_rows(sensor):
    """Rows of a data.csv without its header, as lists of texts."""
    lines = (sensor / "data.csv").read_text().splitlines()
    return [line.split(",") for line in lines if line and not line.startswith("#")]


def read_sensor(sensor):
    """The sensor.yaml, without the first line of OpenCV's format."""
    text = (sensor / "sensor.yaml").read_text()
    return yaml.safe_load(text.removeprefix("%YAML:1.0"))


def pose_of(row):
    """Pose of the body: position, and quaternion with w first (EuRoC)."""
    values = [float(text) for text in row[1:8]]
    T = np.eye(4)
    T[:3, :3] = o3d.geometry.get_rotation_matrix_from_quaternion(np.array(values[3:]))
    T[:3, 3] = values[:3]
    return T


def distorted_pixels(sensor):
    """For each pixel of an ideal camera, the nearest one of the image, as row and column; its
    coordinates are clipped to the image."""
    width, height = sensor["resolution"]
    fx, fy, cx, cy = sensor["intrinsics"]
    k1, k2, p1, p2 = sensor["distortion_coefficients"]
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    x, y = (u - cx) / fx, (v - cy) / fy
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    u = fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx
    v = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy
    return (np.clip(np.rint(v), 0, height - 1).astype(int),
            np.clip(np.rint(u), 0, width - 1).astype(int))


def read_image(file, pixels):
    return np.ascontiguousarray(np.asarray(o3d.io.read_image(str(file)))[pixels])


def nearest(stamps, stamp, most_ns=5_000_000):
    """Index of the stamp nearest to another one, or None beyond 5 ms."""
    k = bisect.bisect_left(stamps, stamp)
    best = min((i for i in (k - 1, k) if 0 <= i < len(stamps)), key=lambda i: abs(stamps[i] - stamp))
    return best if abs(stamps[best] - stamp) <= most_ns else None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("mesh", type=pathlib.Path, help="PLY file to write")
    parser.add_argument("--voxel", type=float, default=0.1, help="side of the voxels [m]")
    parser.add_argument("--truncation", type=float, default=4.0, help="[voxels]")
    parser.add_argument("--range", type=float, default=20.0, help="largest depth [m]")
    options = parser.parse_args()
    mav0 = options.recording / "mav0"
    depth0 = read_sensor(mav0 / "depth0")
    width, height = depth0["resolution"]
    camera = o3d.camera.PinholeCameraIntrinsic(width, height, *depth0["intrinsics"])
    pixels = distorted_pixels(depth0)
    T_body_cam = np.array(depth0["T_BS"]["data"], dtype=float).reshape(4, 4)
    poses = {int(row[0]): pose_of(row) for row in read_rows(mav0 / "state_groundtruth_estimate0")}
    images = {int(row[0]): row[1].strip() for row in read_rows(mav0 / "cam0")}
    pose_stamps, image_stamps = sorted(poses), sorted(images)
    colors = o3d.pipelines.integration.TSDFVolumeColorType.RGB8
    volume = o3d.pipelines.integration.ScalableTSDFVolume(
        options.voxel, options.truncation * options.voxel, colors)
    frames_ms = []
    for row in read_rows(mav0 / "depth0"):
        at_pose, at_image = nearest(pose_stamps, int(row[0])), nearest(image_stamps, int(row[0]))
        if at_pose is None or at_image is None:
            continue
        depth = read_image(mav0 / "depth0/data" / row[1].strip(), pixels)
        grey = read_image(mav0 / "cam0/data" / images[image_stamps[at_image]], pixels)
        if grey.ndim == 2:
            grey = np.repeat(grey[:, :, None], 3, axis=2)
        began = time.process_time()
        rgbd = o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(grey), o3d.geometry.Image(depth),
            depth_trunc=options.range, convert_rgb_to_intensity=False)
        volume.integrate(rgbd, camera, np.linalg.inv(poses[pose_stamps[at_pose]] @ T_body_cam))
        frames_ms.append(1e3 * (time.process_time() - began))
    began = time.process_time()
    mesh = volume.extract_triangle_mesh()
    mesh_s = time.process_time() - began
    o3d.io.write_triangle_mesh(str(options.mesh), mesh)
    print(json.dumps({
        "frames": len(frames_ms), "faces": len(mesh.triangles),
        "frame_ms": round(statistics.median(frames_ms), 1), "mesh_s": round(mesh_s, 2),
        "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
        "mesh_MB": round(options.mesh.stat().st_size / 1e6, 1)}))


if __name__ == "__main__":
    main()
