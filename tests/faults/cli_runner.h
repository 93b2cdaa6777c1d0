// SPDX-License-Identifier: MIT
// Runs the built `burin` and keeps what it says; writes small recorded sequences for it.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {

struct Ran {
    int exit = -1;
    std::string out, err;
    long lines() const { return std::count(err.begin(), err.end(), '\n'); }
};

// stdin, stdout and stderr are files: nothing is a terminal.
inline Ran run_burin(std::vector<std::string> arguments) {
    const TempFolder folder;
    const std::string out = folder.path("out"), err = folder.path("err");
    arguments.insert(arguments.begin(), BURIN_CLI);
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        ::dup2(::open("/dev/null", O_RDONLY), 0);
        ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT, 0600), 1);
        ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
        ::execv(argv[0], argv.data());
        ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), read_bytes(out),
            read_bytes(err)};
}

// One line on stderr that holds all of `parts`, nothing on stdout.
inline void expect_failure(const Ran& ran, int exit, const std::vector<std::string>& parts) {
    EXPECT_EQ(ran.exit, exit) << ran.err;
    EXPECT_EQ(ran.lines(), 1) << "stderr: '" << ran.err << "'";
    EXPECT_EQ(ran.out, "");
    for (const std::string& part : parts)
        EXPECT_NE(ran.err.find(part), std::string::npos)
            << "'" << ran.err << "' does not name '" << part << "'";
}

// A sequence in TUM layout of the ball before the wall: 160 x 120, `frames` frames, one second apart.
inline void write_sequence(const TempFolder& folder, int frames) {
    const Camera c = test_camera();
    std::string associations, poses;
    for (int i = 0; i < frames; ++i) {
        const Se3 T = arc_pose(i, std::max(frames, 2));
        const Image<float> depth = ball_and_wall().depth(c, T);
        Image<std::uint16_t> raw(c.width, c.height);
        for (std::size_t k = 0; k < raw.pixels.size(); ++k)
            raw.pixels[k] = static_cast<std::uint16_t>(5000 * depth.pixels[k] + 0.5f);
        Image<std::uint8_t> rgb(c.width, c.height, 3, 120);
        for (std::size_t k = 0; k < rgb.pixels.size(); k += 3) rgb.pixels[k] = 240;
        const std::string n = std::to_string(i) + ".png", stamp = std::to_string(i + 1) + ".0";
        for (const char* sub : {"depth", "rgb"}) std::filesystem::create_directories(folder.path(sub));
        ASSERT_TRUE(
            write_png(folder.path("depth/" + n), static_cast<View<const std::uint16_t>>(raw.view())).ok());
        ASSERT_TRUE(
            write_png(folder.path("rgb/" + n), static_cast<View<const std::uint8_t>>(rgb.view())).ok());
        associations += stamp + " rgb/" + n + " " + stamp + " depth/" + n + "\n";
        const Quaternion q = quaternion_of(T.R);
        char line[300];
        std::snprintf(line, sizeof line, "%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", stamp.c_str(), T.t.x,
                      T.t.y, T.t.z, q.x, q.y, q.z, q.w);
        poses += line;
    }
    folder.text("associations.txt", associations);
    folder.text("groundtruth.txt", poses);
    char camera[200];
    std::snprintf(camera, sizeof camera,
                  "fx %g\nfy %g\ncx %g\ncy %g\nwidth %d\nheight %d\ndepth_scale 5000\n", c.fx, c.fy, c.cx,
                  c.cy, c.width, c.height);
    folder.text("camera.txt", camera);
}

// Names in a folder, sorted; "" when there is none.
inline std::string listing(const std::string& path) {
    std::vector<std::string> names;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(path, error))
        names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : " ") + name;
    return all;
}

inline nlohmann::json parse_json(const std::string& text) {
    nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << "no JSON: " << text.substr(0, 300);
    return json;
}

}  // namespace burin
