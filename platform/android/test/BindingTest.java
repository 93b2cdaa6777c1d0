// SPDX-License-Identifier: MIT
import burin.BurinException;
import burin.BurinMap;

import java.io.File;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.util.ArrayList;
import java.util.List;

/** The binding on a desktop JVM: a wall is fused, meshed, saved and loaded; misuse throws and crashes nothing. */
public final class BindingTest {
    static final int WIDTH = 64, HEIGHT = 48, PADDED = 2 * WIDTH + 6;  // rows as a camera pads them
    static final BurinMap.Camera CAMERA = new BurinMap.Camera(WIDTH, HEIGHT, 50, 50, 31.5, 23.5);
    static final double[] IDENTITY = {0, 0, 0, 0, 0, 0, 1};

    static void check(boolean condition, String what) {
        if (!condition) throw new AssertionError(what);
    }

    static void expectFailure(int status, String part, Runnable call) {
        try {
            call.run();
        } catch (BurinException e) {
            check(e.status == status, "status " + e.status + " instead of " + status + ": " + e.getMessage());
            check(e.getMessage().contains(part), "'" + e.getMessage() + "' does not name '" + part + "'");
            return;
        }
        throw new AssertionError("no exception; expected one that names '" + part + "'");
    }

    static ByteBuffer direct(int bytes) {
        return ByteBuffer.allocateDirect(bytes).order(ByteOrder.nativeOrder());
    }

    static ByteBuffer wall(int millimetres) {
        ByteBuffer depth = direct(PADDED * HEIGHT);
        for (int y = 0; y < HEIGHT; ++y)
            for (int x = 0; x < WIDTH; ++x) depth.putShort(y * PADDED + 2 * x, (short) millimetres);
        return depth;
    }

    static BurinMap.Config config() {
        BurinMap.Config c = new BurinMap.Config();
        c.voxelM = 0.02f;
        c.budgetBytes = 16 << 20;
        c.maxWidth = WIDTH;
        c.maxHeight = HEIGHT;
        return c;
    }

    static void fuseMeshSaveLoad(String folder) {
        ByteBuffer red = direct(3 * WIDTH * HEIGHT);
        for (int i = 0; i < WIDTH * HEIGHT; ++i) red.put(3 * i, (byte) 200);
        String file = new File(folder, "wall.burin").getPath();
        BurinMap.Config two = config();
        two.threads = 2;
        try (BurinMap map = new BurinMap(config()); BurinMap other = new BurinMap(two)) {
            for (int i = 0; i < 3; ++i) {
                BurinMap.FrameResult r = map.integrate(i, wall(1000), PADDED, 0.001, CAMERA, IDENTITY, red, 3 * WIDTH,
                                                       CAMERA, IDENTITY);
                check(r.validPixels == WIDTH * HEIGHT, "valid pixels: " + r.validPixels);
                check(!r.poolFull && r.droppedChunks == 0 && r.fusedChunks > 0, "a frame dropped chunks");
                check((r.newChunks > 0) == (i == 0), "new chunks in frame " + i + ": " + r.newChunks);
            }
            BurinMap.Mesh m = map.mesh();
            check(m.vertices > 100 && m.triangles > 100, "the mesh is empty");
            int coloured = 0;
            for (int v = 0; v < m.vertices; ++v) {
                float z = m.positions.getFloat(12 * v + 8);
                check(Math.abs(z - 1) < 1e-3, "a vertex at z = " + z + ", the wall is at 1");
                check(m.normals.getFloat(12 * v + 8) < -0.99f, "a normal does not face the camera");
                if ((m.colours.get(3 * v) & 255) == 200 && m.colours.get(3 * v + 1) == 0) ++coloured;
            }
            check(coloured > 0.9 * m.vertices, "of " + m.vertices + " vertices " + coloured + " are red");  // rims are white
            for (int i = 0; i < 3 * m.triangles; ++i) {
                int index = m.indices.getInt(4 * i);
                check(index >= 0 && index < m.vertices, "triangle index " + index);
            }
            map.save(file);
            other.load(file);
            check(map.hash() == other.hash() && map.hash() != 0, "the loaded map differs");
            map.reset();
            check(map.mesh().vertices == 0 && map.hash() != other.hash(), "reset left something");
        }
    }

    static void misuse(String folder) {
        BurinMap.Config bad = config();
        bad.voxelM = 7;
        expectFailure(-1, "voxel_m", () -> new BurinMap(bad));
        BurinMap.Config small = config();
        small.budgetBytes = 1000;
        expectFailure(-2, "budget", () -> new BurinMap(small));

        BurinMap map = new BurinMap(config());
        ByteBuffer depth = wall(1000);
        expectFailure(-1, "depth", () -> map.integrate(0, direct(100), PADDED, 0.001, CAMERA, IDENTITY));
        expectFailure(-1, "depth", () -> map.integrate(0, null, PADDED, 0.001, CAMERA, IDENTITY));
        expectFailure(-1, "depth",
                      () -> map.integrate(0, ByteBuffer.allocate(PADDED * HEIGHT), PADDED, 0.001, CAMERA, IDENTITY));
        expectFailure(-1, "stride", () -> map.integrate(0, depth, -1, 0.001, CAMERA, IDENTITY));
        expectFailure(-1, "pose", () -> map.integrate(0, depth, PADDED, 0.001, CAMERA, new double[3]));
        expectFailure(-1, "pose", () -> map.integrate(0, depth, PADDED, 0.001, CAMERA, null));
        expectFailure(-1, "width", () -> map.integrate(0, direct(1 << 20), 2 * 640, 0.001,
                                                       new BurinMap.Camera(640, 48, 50, 50, 31, 23), IDENTITY));
        expectFailure(-1, "rgb", () -> map.integrate(0, depth, PADDED, 0.001, CAMERA, IDENTITY, direct(9), 3 * WIDTH,
                                                     CAMERA, IDENTITY));
        expectFailure(-1, "path", () -> map.save(null));
        expectFailure(-3, "none.burin", () -> map.load(new File(folder, "none.burin").getPath()));
        check(map.mesh().vertices == 0, "a call that failed left something");
        map.close();
        map.close();
        try {
            map.hash();
            throw new AssertionError("a closed map answers");
        } catch (IllegalStateException e) {
            check(e.getMessage().contains("closed"), e.getMessage());
        }
    }

    static void manyMaps() {
        List<BurinMap> maps = new ArrayList<>();
        BurinMap.Config c = config();
        c.budgetBytes = 2 << 20;
        for (int round = 0; round < 2; ++round) {
            for (int i = 0; i < 64; ++i) maps.add(new BurinMap(c));
            expectFailure(-5, "64", () -> new BurinMap(c));
            maps.forEach(BurinMap::close);
            maps.clear();
        }
    }

    public static void main(String[] arguments) {
        System.out.println("kernels: " + BurinMap.simdName());
        fuseMeshSaveLoad(arguments[0]);
        misuse(arguments[0]);
        manyMaps();
        System.out.println("binding: passed");
    }
}
