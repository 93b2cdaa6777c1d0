// SPDX-License-Identifier: MIT
#include "datasets/packed_dataset.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "datasets/file_dataset.h"
#include "datasets/image_file.h"

namespace burin {
namespace {

template <class T>
void clear(Image<T>* image) {
    image->pixels.clear();  // keeps the buffer
    image->width = image->height = 0;
}

std::uint32_t raw_bytes(const Camera& camera, std::uint32_t bytes_a_pixel) {
    return static_cast<std::uint32_t>(camera.width) * static_cast<std::uint32_t>(camera.height) *
           bytes_a_pixel;
}

class PackedDataset final : public Dataset {
  public:
    explicit PackedDataset(PackedList list) : list_(std::move(list)) {}
    const char* format() const override { return list_.format; }
    int frame_count() const override { return static_cast<int>(list_.frames.size()); }
    std::string notes() const override { return list_.notes; }
    Status load(int index, Frame* out) const override;

  private:
    Status load_images(const PackedFrame& frame, const std::string& name, Frame* out) const;
    Status load_colour(const PackedFrame& frame, const std::string& name, Frame* out) const;

    PackedList list_;
};

Status PackedDataset::load_colour(const PackedFrame& frame, const std::string& name, Frame* out) const {
    clear(&out->colour);
    if (frame.colour.bytes == 0) return {};
    const Camera& camera = list_.cameras.colour;
    Image<std::uint8_t>& colour = out->colour;
    if (list_.raw_colour && frame.colour.bytes == raw_bytes(camera, 3)) {
        colour.width = camera.width;
        colour.height = camera.height;
        colour.channels = 3;
        colour.pixels.resize(frame.colour.bytes);
        return list_.file.read(frame.colour.offset, frame.colour.bytes, colour.pixels.data());
    }
    std::string bytes;
    BURIN_TRY(list_.file.read(frame.colour.offset, frame.colour.bytes, &bytes));
    BURIN_TRY(decode_rgb(bytes, name, &colour));
    if (colour.width != camera.width || colour.height != camera.height)
        return Status::error(Code::format, "%s: colour image is %dx%d, expected %dx%d", name.c_str(),
                             colour.width, colour.height, camera.width, camera.height);
    if (list_.swap_red_blue)
        for (std::size_t i = 0; i < colour.pixels.size(); i += 3)
            std::swap(colour.pixels[i], colour.pixels[i + 2]);
    return {};
}

Status PackedDataset::load_images(const PackedFrame& frame, const std::string& name, Frame* out) const {
    const Camera& camera = list_.cameras.depth;
    std::string bytes;
    BURIN_TRY(list_.file.read(frame.depth.offset, frame.depth.bytes, &bytes));
    const bool raw = list_.raw_depth || (list_.raw_depth_by_size && bytes.size() == raw_bytes(camera, 2));
    BURIN_TRY(decode_packed_depth(bytes, raw, name, camera.width, camera.height, &out->depth_u16));
    return load_colour(frame, name, out);
}

Status PackedDataset::load(int index, Frame* out) const {
    if (index < 0 || index >= frame_count())
        return Status::error(Code::invalid_argument, "%s: frame %d, expected 0..%d",
                             list_.file.path().c_str(), index, frame_count() - 1);
    const PackedFrame& frame = list_.frames[static_cast<std::size_t>(index)];
    clear(&out->depth_f32);
    clear(&out->confidence);
    out->imu.clear();
    Status status;
    try {
        status = load_images(frame, list_.file.path() + ": frame " + std::to_string(index), out);
    } catch (...) {
        status = Status::error(Code::insufficient_memory, "%s: no memory to decode frame %d",
                               list_.file.path().c_str(), index);
    }
    if (!status) {  // never half a frame
        clear(&out->depth_u16);
        clear(&out->colour);
        return status;
    }
    out->min_confidence = 0;
    out->t_ns = frame.t_ns;
    out->colour_t_ns = frame.colour_t_ns;
    out->depth_unit_m = 1.0 / list_.cameras.depth_scale;
    out->depth_camera = list_.cameras.depth;
    out->colour_camera = list_.cameras.colour;
    out->T_colour_depth = list_.cameras.T_colour_depth;
    out->has_pose = frame.has_pose;
    out->T_world_camera = frame.T_world_camera;
    out->T_camera_imu = list_.cameras.T_camera_imu;
    return {};
}

}  // namespace

Status decode_packed_depth(std::string_view bytes, bool raw, const std::string& name, int width, int height,
                           Image<std::uint16_t>* out) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    out->pixels.resize(pixels);
    out->width = width;
    out->height = height;
    out->channels = 1;
    std::size_t got = bytes.size();
    bool whole = raw && got == 2 * pixels;
    if (whole) {
        std::memcpy(out->pixels.data(), bytes.data(), got);
    } else if (!raw) {
        uLongf room = static_cast<uLongf>(2 * pixels);
        const int code = uncompress(static_cast<Bytef*>(static_cast<void*>(out->pixels.data())), &room,
                                    reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(got));
        got = static_cast<std::size_t>(room);
        whole = code == Z_OK && got == 2 * pixels;
    }
    if (whole) return {};
    clear(out);
    return Status::error(Code::format,
                         "%s: %zu bytes of %s depth do not give %dx%d pixels of 16 bits, expected just these",
                         name.c_str(), bytes.size(), raw ? "raw" : "zlib", width, height);
}

Result<std::unique_ptr<Dataset>> make_packed_dataset(PackedList list) {
    const char* path = list.file.path().c_str();
    if (list.frames.empty())
        return Status::error(Code::format, "%s: holds 0 frames, expected at least 1", path);
    if (!(list.cameras.depth_scale > 0))
        return Status::error(Code::format, "%s: depth scale is %g, expected a positive number", path,
                             list.cameras.depth_scale);
    for (const auto& [camera, what] :
         {std::pair(&list.cameras.depth, "depth"), std::pair(&list.cameras.colour, "colour")})
        if (const Status status = check_camera(*camera, what); !status)
            return Status::error(Code::format, "%s: %s", path, status.text());
    return std::unique_ptr<Dataset>(std::make_unique<PackedDataset>(std::move(list)));
}

void mend_stamps(PackedList* list) {
    const auto falls = [](const PackedFrame& a, const PackedFrame& b) { return a.t_ns >= b.t_ns; };
    auto& frames = list->frames;
    if (std::adjacent_find(frames.begin(), frames.end(), falls) == frames.end()) return;
    for (std::size_t i = 0; i < frames.size(); ++i)
        frames[i].t_ns = frames[i].colour_t_ns = stamp_at_30_hz(static_cast<std::int64_t>(i));
    list->notes += "time stamps do not rise: those of 30 Hz in their place\n";
}

void note_missing_poses(PackedList* list, const char* why) {
    const auto missing = std::count_if(list->frames.begin(), list->frames.end(),
                                       [](const PackedFrame& f) { return !f.has_pose; });
    if (missing == 0) return;
    list->notes += std::to_string(missing) + " of " + std::to_string(list->frames.size()) +
                   " frames have no pose: " + why + "\n";
}

}  // namespace burin
