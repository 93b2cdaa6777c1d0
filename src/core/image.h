// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

namespace burin {

// A non-owning image: `height` rows of `width` pixels, `stride` elements from one row to the next.
// For interleaved colour T is the channel type and width counts pixels; see `channels`.
template <class T>
struct View {
    T* data = nullptr;
    int width = 0, height = 0;
    std::ptrdiff_t stride = 0;  // elements of T
    int channels = 1;

    T* row(int y) const { return data + y * stride; }
    T& at(int x, int y, int channel = 0) const { return data[y * stride + x * channels + channel]; }
    bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
    operator View<const T>() const { return {data, width, height, stride, channels}; }
};

// An owning image, rows packed. For tools and tests: the runtime owns no images.
template <class T>
struct Image {
    int width = 0, height = 0, channels = 1;
    std::vector<T> pixels;

    Image() = default;
    Image(int w, int h, int c = 1, T fill = T{}) : width(w), height(h), channels(c) {
        pixels.assign(static_cast<std::size_t>(w) * h * c, fill);
    }
    View<T> view() { return {pixels.data(), width, height, std::ptrdiff_t(width) * channels, channels}; }
    View<const T> view() const {
        return {pixels.data(), width, height, std::ptrdiff_t(width) * channels, channels};
    }
    bool empty() const { return pixels.empty(); }
};

}  // namespace burin
