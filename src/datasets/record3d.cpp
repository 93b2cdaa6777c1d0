// SPDX-License-Identifier: MIT
// Record3D, an iOS app: a .r3d file is a zip of metadata (JSON, record3d_metadata.cpp) and rgbd/N.jpg,
// N.depth, N.conf. Facts from the author's answers at github.com/marek-simonik/record3d, issues 7, 60, 86 and
// 93: depth is 32-bit floats in metres, NaN for none, row by row, compressed by LZFSE; confidence ARKit's
// level, 8 bits, likewise, missing for the front camera. Depth shows the view of the image at a smaller size.
#include "datasets/record3d.h"

#include <zip.h>

#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

#include "capture/dataset.h"
#include "datasets/arkit.h"
#include "datasets/file.h"
#include "datasets/formats.h"
#include "datasets/image_file.h"
#include "datasets/lzfse.h"

namespace burin {
namespace {

constexpr std::size_t kMaxMetadata = std::size_t(256) << 20;
constexpr std::size_t kMaxEntry = std::size_t(256) << 20;  // floats of 8192 x 8192 pixels
constexpr double kUsualFps = 60;                           // of files that do not say it

struct Entries {
    std::int64_t depth = -1, colour = -1, confidence = -1;  // in the archive
};

template <class T>
void clear(Image<T>* image) {
    image->pixels.clear();  // keeps the buffer
    image->width = image->height = 0;
}

class Record3d final : public Dataset {
  public:
    ~Record3d() override {
        if (zip_) zip_discard(zip_);
    }
    Status open(const std::string& path);
    const char* format() const override { return "record3d"; }
    int frame_count() const override { return static_cast<int>(frames_.size()); }
    std::string notes() const override { return notes_; }
    Status load(int index, Frame* out) const override;

  private:
    struct Member {
        int number;  // N of rgbd/N.depth, the index into the metadata's lists
        Entries entries;
    };
    Status list_frames();
    Status read_metadata();
    void set_stamps();
    Status read_entry(std::int64_t entry, std::size_t most, std::string* out) const;
    // LZFSE, or plain where it has just the bytes wanted.
    Status expand(std::int64_t entry, const std::string& name, std::size_t wanted, std::string* out) const;
    Status find_depth_size();
    Status load_images(const Member& frame, Frame* out) const;
    Camera colour_camera(const Member& frame) const {
        const auto i = static_cast<std::size_t>(frame.number);
        return i < meta_.colour_of_frame.size() ? meta_.colour_of_frame[i] : meta_.colour;
    }

    std::string path_, notes_;
    zip_t* zip_ = nullptr;
    mutable std::mutex mutex_;  // of zip_, which one thread may use at a time
    Record3dMetadata meta_;
    std::vector<Member> frames_;
    std::vector<std::int64_t> t_ns_;
};

Status Record3d::read_entry(std::int64_t entry, std::size_t most, std::string* out) const {
    const std::lock_guard lock(mutex_);
    const auto index = static_cast<zip_uint64_t>(entry);
    zip_stat_t info;
    zip_stat_init(&info);
    const char* name = zip_get_name(zip_, index, 0);
    const std::string where = path_ + ": " + printable(name ? name : "?");
    if (zip_stat_index(zip_, index, 0, &info) != 0 || !(info.valid & ZIP_STAT_SIZE) || info.size > most)
        return Status::error(Code::format, "%s: %llu bytes, expected at most %zu", where.c_str(),
                             static_cast<unsigned long long>(info.size), most);
    out->resize(static_cast<std::size_t>(info.size));
    zip_file_t* file = zip_fopen_index(zip_, index, 0);
    const zip_int64_t got = file ? zip_fread(file, out->data(), out->size()) : -1;
    // The checksum is looked at when the end is read.
    char past;
    const bool whole = got == static_cast<zip_int64_t>(out->size()) && zip_fread(file, &past, 1) == 0;
    if (file) zip_fclose(file);
    if (whole) return {};
    return Status::error(Code::format, "%s: %s, expected %zu whole bytes", where.c_str(),
                         file ? "is cut or damaged" : zip_strerror(zip_), out->size());
}

Status Record3d::list_frames() {
    std::map<int, Entries> found;
    const zip_int64_t count = zip_get_num_entries(zip_, 0);
    for (zip_int64_t i = 0; i < count; ++i) {
        const char* text = zip_get_name(zip_, static_cast<zip_uint64_t>(i), 0);
        const std::string_view name = text ? text : "";
        if (name.substr(0, 5) != "rgbd/") continue;
        const std::int64_t number = first_number(name.substr(5));
        const std::string_view end = name.substr(std::min(name.rfind('.'), name.size()));
        if (number < 0) continue;
        Entries& entries = found[static_cast<int>(number)];
        if (end == ".depth") entries.depth = i;
        if (end == ".jpg") entries.colour = i;
        if (end == ".conf") entries.confidence = i;
    }
    for (const auto& [number, entries] : found)
        if (entries.depth >= 0) frames_.push_back({number, entries});
    if (frames_.empty())
        return Status::error(Code::format, "%s: %lld files but no rgbd/N.depth, expected a Record3D video",
                             path_.c_str(), static_cast<long long>(count));
    return {};
}

Status Record3d::read_metadata() {
    const zip_int64_t entry = zip_name_locate(zip_, "metadata", 0);
    if (entry < 0)
        return Status::error(Code::format, "%s: no file 'metadata', expected a Record3D video",
                             path_.c_str());
    std::string text;
    BURIN_TRY(read_entry(entry, kMaxMetadata, &text));
    Result<Record3dMetadata> meta = parse_record3d_metadata(text, path_ + ": metadata");
    if (!meta) return meta.status();
    meta_ = std::move(*meta);
    return {};
}

void Record3d::set_stamps() {
    const bool given = static_cast<std::size_t>(frames_.back().number) < meta_.t_ns.size();
    const double fps = meta_.fps > 0 ? meta_.fps : kUsualFps;
    if (!given)
        notes_ += "no frameTimestamps for all frames: stamps by " + std::to_string(fps) + " frames/s\n";
    for (const Member& frame : frames_)
        t_ns_.push_back(given ? meta_.t_ns[static_cast<std::size_t>(frame.number)]
                              : std::llround(frame.number * 1e9 / fps));
}

// Older files do not say it: the shape is that of the image.
Status Record3d::find_depth_size() {
    if (meta_.depth_width > 0 && meta_.depth_height > 0) return {};
    std::string bytes, floats;
    BURIN_TRY(read_entry(frames_.front().entries.depth, kMaxEntry, &bytes));
    BURIN_TRY(decode_lzfse(bytes, path_ + ": first depth image", kMaxEntry, &floats));
    const double pixels = static_cast<double>(floats.size() / 4);
    meta_.depth_width =
        static_cast<int>(std::lround(std::sqrt(pixels * meta_.colour.width / meta_.colour.height)));
    meta_.depth_height = meta_.depth_width > 0 ? static_cast<int>(pixels) / meta_.depth_width : 0;
    if (meta_.depth_width < 1 || meta_.depth_width > kMaxImageSide || meta_.depth_height < 1 ||
        meta_.depth_height > kMaxImageSide || double(meta_.depth_width) * meta_.depth_height != pixels)
        return Status::error(
            Code::format, "%s: %zu bytes of depth are no image of the shape %dx%d, expected one or dw and dh",
            path_.c_str(), floats.size(), meta_.colour.width, meta_.colour.height);
    return {};
}

Status Record3d::open(const std::string& path) {
    path_ = path;
    int code = 0;
    zip_ = zip_open(path.c_str(), ZIP_RDONLY, &code);
    if (!zip_) {
        zip_error_t error;
        zip_error_init_with_code(&error, code);
        const std::string text = zip_error_strerror(&error);
        zip_error_fini(&error);
        return Status::error(code == ZIP_ER_OPEN ? Code::io : Code::format,
                             "%s: %s, expected a whole zip archive", path.c_str(), text.c_str());
    }
    BURIN_TRY(list_frames());
    BURIN_TRY(read_metadata());
    set_stamps();
    BURIN_TRY(find_depth_size());
    std::size_t without = 0, unsure = 0;
    for (const Member& frame : frames_) {
        without += static_cast<std::size_t>(frame.number) >= meta_.T_world_camera.size();
        unsure += frame.entries.confidence < 0;
    }
    const std::string of = " of " + std::to_string(frames_.size());
    if (without > 0) notes_ += std::to_string(without) + of + " frames have no pose: not in the metadata\n";
    if (unsure > 0) notes_ += std::to_string(unsure) + of + " frames have no confidence\n";
    return {};
}

Status Record3d::expand(std::int64_t entry, const std::string& name, std::size_t wanted,
                        std::string* out) const {
    std::string bytes;
    BURIN_TRY(read_entry(entry, kMaxEntry, &bytes));
    if (bytes.size() == wanted && bytes.compare(0, 3, "bvx") != 0)
        *out = std::move(bytes);
    else
        BURIN_TRY(decode_lzfse(bytes, name, wanted, out));
    if (out->size() == wanted) return {};
    return Status::error(Code::format, "%s: %zu bytes, expected %zu for %dx%d pixels", name.c_str(),
                         out->size(), wanted, meta_.depth_width, meta_.depth_height);
}

Status Record3d::load_images(const Member& frame, Frame* out) const {
    const int width = meta_.depth_width, height = meta_.depth_height;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const std::string where = path_ + ": rgbd/" + std::to_string(frame.number);
    std::string bytes;
    BURIN_TRY(expand(frame.entries.depth, where + ".depth", 4 * pixels, &bytes));
    out->depth_f32.width = width;
    out->depth_f32.height = height;
    out->depth_f32.pixels.resize(pixels);
    std::memcpy(out->depth_f32.pixels.data(), bytes.data(), bytes.size());
    clear(&out->confidence);
    if (frame.entries.confidence >= 0) {
        BURIN_TRY(expand(frame.entries.confidence, where + ".conf", pixels, &bytes));
        out->confidence.width = width;
        out->confidence.height = height;
        out->confidence.pixels.assign(bytes.begin(), bytes.end());
    }
    clear(&out->colour);
    if (frame.entries.colour < 0) return {};
    BURIN_TRY(read_entry(frame.entries.colour, kMaxEntry, &bytes));
    return decode_rgb(bytes, where + ".jpg", &out->colour);
}

Status Record3d::load(int index, Frame* out) const {
    if (index < 0 || index >= frame_count())
        return Status::error(Code::invalid_argument, "%s: frame %d, expected 0..%d", path_.c_str(), index,
                             frame_count() - 1);
    const Member& frame = frames_[static_cast<std::size_t>(index)];
    clear(&out->depth_u16);
    out->imu.clear();
    Status status;
    try {
        status = load_images(frame, out);
    } catch (...) {
        status = Status::error(Code::insufficient_memory, "%s: no memory to decode frame %d", path_.c_str(),
                               index);
    }
    if (!status) {  // never half a frame
        clear(&out->depth_f32);
        clear(&out->confidence);
        clear(&out->colour);
        return status;
    }
    const Camera camera = colour_camera(frame);
    out->t_ns = out->colour_t_ns = t_ns_[static_cast<std::size_t>(index)];
    out->depth_unit_m = 1;
    out->min_confidence = out->confidence.empty() ? std::uint8_t{0} : kDefaultMinConfidence;
    out->depth_camera = scaled_camera(camera, meta_.depth_width, meta_.depth_height);
    out->colour_camera =
        out->colour.empty() ? camera : scaled_camera(camera, out->colour.width, out->colour.height);
    out->T_colour_depth = Se3();
    const auto i = static_cast<std::size_t>(frame.number);
    out->has_pose = i < meta_.T_world_camera.size();
    out->T_world_camera = out->has_pose ? meta_.T_world_camera[i] : Se3();
    out->T_camera_imu = Se3();
    return {};
}

}  // namespace

bool looks_like_record3d(const std::string& path) { return has_ending(path, ".r3d") && is_file(path); }

Result<std::unique_ptr<Dataset>> open_record3d(const std::string& path) {
    auto dataset = std::make_unique<Record3d>();
    BURIN_TRY(dataset->open(path));
    return std::unique_ptr<Dataset>(std::move(dataset));
}

}  // namespace burin
