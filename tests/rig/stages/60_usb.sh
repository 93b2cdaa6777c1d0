# Burin's own driver of USB sensors: every depth format, bulk and isochronous, colour, infrared, accelerometer.
plug rig_kinect
check usb.list rig_client list
check usb.kinect.depth11 rig_client usb:045e:02ae 8
check usb.kinect.gives_back [ "$(basename "$(readlink -f /sys/bus/usb/devices/[0-9]-1:1.0/driver)")" = kinect ]
check usb.kinect.depth10 rig_client usb: 5 --depth-format packed10
check usb.kinect.bayer rig_client usb: 5 --streams colour
check usb.kinect.uyvy rig_client usb: 5 --streams colour --colour-format UYVY
check usb.kinect.infrared rig_client usb: 5 --streams infrared
check usb.kinect.both rig_client usb: 8 --streams depth,colour
check usb.kinect.accelerometer rig_client usb:,accelerometer 20 --imu 5 --imu-is 0.4909,9.7229,-1.4728
check usb.kinect.descriptor rig_client usb: 5 --fd /dev/bus/usb/001/$(printf %03d $(cat /sys/bus/usb/devices/1-1/devnum))
# Memory that the allocator keeps for each thread would count as lost.
export GLIBC_TUNABLES=glibc.malloc.tcache_count=0
check usb.kinect.cycles rig_client usb: 1 --cycles 12
plug rig_ps1080
check usb.ps1080.packed11 rig_client usb:1d27:0601 5
check usb.ps1080.cycles rig_client usb: 1 --cycles 15
unset GLIBC_TUNABLES
check usb.ps1080.packed12 rig_client usb: 5 --depth-format packed12
check usb.ps1080.packed10 rig_client usb: 5 --depth-format packed10
check usb.ps1080.shift16 rig_client usb: 5 --depth-format shift16
check usb.ps1080.compressed rig_client usb: 5 --depth-format ps-depth
check usb.ps1080.qvga rig_client usb: 5 --size 320x240 --fps 30
check usb.ps1080.iso rig_client usb:,iso 5
check usb.ps1080.iso16 rig_client usb:,iso 5 --depth-format shift16
check usb.ps1080.uyvy rig_client usb: 5 --streams colour
check usb.ps1080.yuyv rig_client usb: 5 --streams colour --colour-format YUYV
check usb.ps1080.bayer rig_client usb: 5 --streams colour --colour-format GRBG
check usb.ps1080.infrared rig_client usb: 5 --streams infrared
check usb.ps1080.both rig_client usb: 8 --streams depth,colour
check usb.ps1080.descriptor rig_client usb: 5 --fd /dev/bus/usb/001/$(printf %03d $(cat /sys/bus/usb/devices/1-1/devnum))
plug rig_ps1080 --id 2bc5:0401
check usb.astra rig_client usb:2bc5:0401 5
