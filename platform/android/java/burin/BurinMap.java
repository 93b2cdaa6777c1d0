// SPDX-License-Identifier: MIT
package burin;

import java.nio.ByteBuffer;
import java.nio.ByteOrder;

/**
 * A map of burin.h. Units, frames and limits are those of that header: metres, T_world_camera, camera axes x right,
 * y down, z forward. A map is used by one thread at a time. Buffers of images are direct and in native order, so that a
 * camera's planes go in without a copy. Failures are {@link BurinException}s; a closed map throws
 * IllegalStateException.
 */
public final class BurinMap implements AutoCloseable {
    static {
        System.loadLibrary("burin_jni");
    }

    /** The fields of burin_config that a phone app sets; the others have their defaults. 0 stands for the default. */
    public static final class Config {
        public float voxelM, truncationVoxels, minDepthM, maxDepthM;
        public long budgetBytes;
        public int maxWidth, maxHeight, threads;
        public boolean colour = true;
    }

    /** A pinhole camera with Brown's distortion (burin_camera). */
    public static final class Camera {
        public final int width, height;
        final double[] parameters;  // fx fy cx cy k1 k2 p1 p2 k3

        public Camera(int width, int height, double fx, double fy, double cx, double cy, double... distortion) {
            if (distortion.length != 0 && distortion.length != 5)
                throw new IllegalArgumentException("distortion: expected none or k1 k2 p1 p2 k3");
            this.width = width;
            this.height = height;
            parameters = new double[] {fx, fy, cx, cy, 0, 0, 0, 0, 0};
            System.arraycopy(distortion, 0, parameters, 4, distortion.length);
        }
    }

    /** What a frame did (burin_frame_result). A full pool is no error: droppedChunks says how much was lost. */
    public static final class FrameResult {
        public final boolean poolFull;
        public final int fusedChunks, newChunks, carvedChunks, droppedChunks, validPixels;

        FrameResult(int[] r) {
            poolFull = (r[0] & 1) != 0;
            fusedChunks = r[1];
            newChunks = r[2];
            carvedChunks = r[3];
            droppedChunks = r[4];
            validPixels = r[5];
        }
    }

    /** The surface: 3 floats a vertex, 3 floats a normal, 3 bytes a colour, 3 ints a triangle, ready for OpenGL. */
    public static final class Mesh {
        public final int vertices, triangles;
        public final ByteBuffer positions, normals, colours, indices;

        Mesh(long vertices, long triangles) {
            this.vertices = Math.toIntExact(vertices);
            this.triangles = Math.toIntExact(triangles);
            positions = direct(12 * vertices);
            normals = direct(12 * vertices);
            colours = direct(3 * vertices);
            indices = direct(12 * triangles);
        }

        private static ByteBuffer direct(long bytes) {
            return ByteBuffer.allocateDirect(Math.toIntExact(bytes)).order(ByteOrder.nativeOrder());
        }
    }

    private long handle;

    public BurinMap(Config c) {
        handle = create(c.voxelM, c.truncationVoxels, c.minDepthM, c.maxDepthM, c.budgetBytes, c.maxWidth, c.maxHeight,
                        c.threads, c.colour);
    }

    /** pose: T_world_camera as tx ty tz qx qy qz qw. Depth is 16-bit, depthUnitM metres a count. */
    public FrameResult integrate(long tNs, ByteBuffer depth, int depthStride, double depthUnitM, Camera camera,
                                 double[] pose) {
        return integrate(tNs, depth, depthStride, depthUnitM, camera, pose, null, 0, null, null);
    }

    /** With colour: 3 bytes a pixel; depthToColour as pose, from the depth camera's axes to the colour camera's. */
    public FrameResult integrate(long tNs, ByteBuffer depth, int depthStride, double depthUnitM, Camera camera,
                                 double[] pose, ByteBuffer rgb, int rgbStride, Camera rgbCamera,
                                 double[] depthToColour) {
        int[] result = new int[6];
        integrate(open(), tNs, depth, depthStride, depthUnitM, camera.width, camera.height, camera.parameters, pose,
                  rgb, rgbStride, rgb == null ? 0 : rgbCamera.width, rgb == null ? 0 : rgbCamera.height,
                  rgb == null ? null : rgbCamera.parameters, depthToColour, result);
        return new FrameResult(result);
    }

    public Mesh mesh() {
        long[] size = new long[2];
        meshSize(open(), size);
        Mesh m = new Mesh(size[0], size[1]);
        mesh(handle, m.positions, m.normals, m.colours, m.indices);
        return m;
    }

    public long hash() { return hash(open()); }
    public void reset() { reset(open()); }
    public void save(String path) { save(open(), path); }
    public void load(String path) { load(open(), path); }

    /** The kernels in use, "neon" for instance. */
    public static native String simdName();

    @Override
    public void close() {
        if (handle != 0) destroy(handle);
        handle = 0;
    }

    private long open() {
        if (handle == 0) throw new IllegalStateException("the map is closed");
        return handle;
    }

    private static native long create(float voxelM, float truncationVoxels, float minDepthM, float maxDepthM,
                                      long budgetBytes, int maxWidth, int maxHeight, int threads, boolean colour);
    private static native void destroy(long handle);
    private static native void integrate(long handle, long tNs, ByteBuffer depth, int depthStride, double depthUnitM,
                                         int width, int height, double[] camera, double[] pose, ByteBuffer rgb,
                                         int rgbStride, int rgbWidth, int rgbHeight, double[] rgbCamera,
                                         double[] depthToColour, int[] result);
    private static native void meshSize(long handle, long[] size);
    private static native void mesh(long handle, ByteBuffer positions, ByteBuffer normals, ByteBuffer colours,
                                    ByteBuffer indices);
    private static native long hash(long handle);
    private static native void reset(long handle);
    private static native void save(long handle, String path);
    private static native void load(long handle, String path);
}
