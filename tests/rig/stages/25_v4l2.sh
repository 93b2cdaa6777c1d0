# Burin's own V4L2: every format of the emulated UVC camera, its streams together, metadata, calibration, vivid.
V=$(node vivid)
check v4l2.vivid.y16 rig_client v4l2:$V 3 --depth-format Y16 --size 640x360 --plain
check v4l2.vivid.y16be rig_client v4l2:$V 3 --depth-format Y16_BE --size 640x360 --plain
check v4l2.vivid.y12 rig_client v4l2:$V 3 --depth-format Y12 --size 640x360 --plain
check v4l2.vivid.bayer rig_client v4l2:$V 3 --streams colour --colour-format GRBG8 --colour-size 640x360 --plain
check v4l2.vivid.yuyv rig_client v4l2:$V 3 --streams colour --colour-format YUYV --colour-size 640x360 --plain
rig_v4l $V set 'Percentage of Dropped Buffers' 30 >/dev/null
check v4l2.vivid.dropped rig_client v4l2:$V 12 --depth-format Y16 --size 640x360 --plain --damaged 30 --damaged-at-least 1
rig_v4l $V set 'Percentage of Dropped Buffers' 0 >/dev/null
rig_v4l $V set 'Inject VIDIOC_STREAMON Error' 1 >/dev/null
check v4l2.vivid.streamon rig_client v4l2:$V 3 --depth-format Y16 --size 640x360 --plain --fails io
rig_v4l $V set 'Inject VIDIOC_REQBUFS Error' 1 >/dev/null
check v4l2.vivid.reqbufs rig_client v4l2:$V 3 --depth-format Y16 --size 640x360 --plain --fails io
check v4l2.vivid.again rig_client v4l2:$V 3 --depth-format Y16 --size 640x360 --plain
plug rig_uvc_camera
D=$(node uvcvideo 0 0) C=$(node uvcvideo 3 0)
check v4l2.list rig_client list
check v4l2.uvc.z16 rig_client v4l2:$D 10
check v4l2.uvc.y16 rig_client v4l2:$D 5 --depth-format Y16
check v4l2.uvc.y10 rig_client v4l2:$D 5 --depth-format Y10 --size 320x240
check v4l2.uvc.y12 rig_client v4l2:$D 5 --depth-format Y12 --size 320x240
check v4l2.uvc.inzi rig_client v4l2:$D 5 --streams depth,infrared --depth-format INZI
check v4l2.uvc.layout rig_client v4l2:$D 5 --streams depth,infrared,confidence --depth-format Y16 --layout
check v4l2.uvc.both rig_client v4l2:$D 8 --streams depth,colour
check v4l2.uvc.infrared rig_client v4l2:$D 5 --streams infrared,infrared_right
check v4l2.uvc.yuyv rig_client v4l2:$D 5 --streams colour --colour-format YUYV
check v4l2.uvc.uyvy rig_client v4l2:$D 5 --streams colour --colour-format UYVY --colour-size 320x240
check v4l2.uvc.mjpg rig_client v4l2:$D 5 --streams colour --colour-format MJPG --damaged 60
check v4l2.uvc.facts rig_client v4l2:$D 2 --streams depth,colour --d4xx
check v4l2.uvc.descriptor rig_client v4l2: 5 --fd $D
plug rig_uvc_camera -f 'at 6 unplug 700'
check v4l2.uvc.replug rig_client v4l2:$(node uvcvideo 0 0) 20 --reconnects 1 --damaged 3 --log
plug rig_uvc_camera -f 'at 3 short_frame 2' -f 'at 8 error_bit 1' -f 'at 12 corrupt_header 1 1'
check v4l2.uvc.bad_frames rig_client v4l2:$(node uvcvideo 0 0) 16 --damaged 12 --damaged-at-least 1 --log
plug rig_uvc_camera -f 'at 4 silent always'
check v4l2.uvc.silent rig_client v4l2:$(node uvcvideo 0 0) 20 --fails timeout
plug rig_uvc_camera --iso
check v4l2.uvc.iso rig_client v4l2:$(node uvcvideo 0 0) 8
for calibration in none zero nan huge crc short type; do
    plug rig_uvc_camera --calibration $calibration
    check v4l2.uvc.absurd rig_client v4l2:$(node uvcvideo 0 0) 2 --nominal --log
done
