# Recording a sensor to a disk that is too small: it says so, keeps what it has, and what it has can be read. Then once more from
# the beginning, where there is room.
plug rig_uvc_camera
D=$(node uvcvideo 0 0)
mkdir -p /tmp/small
mount -t tmpfs -o size=1m none /tmp/small
cat >/bin/record_until_full <<'END_OF_SCRIPT'
#!/bin/sh
burin record "v4l2:$1" -o /tmp/small --frames 0:400 --json --quiet
code=$?
df /tmp/small | tail -n 1
[ $code = 1 ] || { echo "exit code $code, expected 1"; exit 1; }
END_OF_SCRIPT
cat >/bin/says_full <<'END_OF_SCRIPT'
#!/bin/sh
record_until_full "$1" >/tmp/full 2>&1 || { cat /tmp/full; exit 1; }
cat /tmp/full
grep '"disk_full":true' /tmp/full >/dev/null && grep -v '"disk_full"' /tmp/full | grep 'the disk is full'
END_OF_SCRIPT
cat >/bin/frames_of <<'END_OF_SCRIPT'
#!/bin/sh
rm -rf /tmp/copy
burin convert "$1" -o /tmp/copy --quiet || exit 1
n=$(ls /tmp/copy/depth | wc -l)
echo "$n frames"
[ "$n" -ge "$2" ]
END_OF_SCRIPT
chmod +x /bin/record_until_full /bin/says_full /bin/frames_of
check record.full says_full $D
check record.full_reads frames_of /tmp/small 2
umount /tmp/small
check record.again burin record v4l2:$D -o /tmp/room --frames 0:6 --quiet --lossless
check record.again_reads frames_of /tmp/room 6
rm -rf /tmp/room /tmp/copy
