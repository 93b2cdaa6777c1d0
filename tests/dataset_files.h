// SPDX-License-Identifier: MIT
// Small data sets made of files in a folder that goes away with the test.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "datasets/image_file.h"

namespace burin {

class TempFolder {
  public:
    TempFolder() {
        static int count = 0;
        path_ = std::filesystem::temp_directory_path() /
                ("burin-test-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
        std::filesystem::create_directories(path_);
    }
    ~TempFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;

    std::string path(const std::string& name = "") const {
        return name.empty() ? path_.string() : (path_ / name).string();
    }

    std::string text(const std::string& name, const std::string& content) const {
        std::filesystem::create_directories((path_ / name).parent_path());
        std::ofstream(path_ / name, std::ios::binary) << content;
        return path(name);
    }

    // A depth image of one value but for its first pixel, which tells frames apart.
    void depth(const std::string& name, int width, int height, std::uint16_t value,
               std::uint16_t first) const {
        std::filesystem::create_directories((path_ / name).parent_path());
        Image<std::uint16_t> image(width, height, 1, value);
        image.pixels[0] = first;
        ASSERT_TRUE(write_png(path(name), image.view()).ok());
    }

    void colour(const std::string& name, int width, int height, std::uint8_t red) const {
        std::filesystem::create_directories((path_ / name).parent_path());
        Image<std::uint8_t> image(width, height, 3);
        for (std::size_t i = 0; i < image.pixels.size(); i += 3) image.pixels[i] = red;
        ASSERT_TRUE(write_png(path(name), image.view()).ok());
    }

  private:
    std::filesystem::path path_;
};

inline std::string read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace burin
