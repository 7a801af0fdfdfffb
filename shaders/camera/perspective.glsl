// Provides camera_ray() of a pinhole: all rays start at the camera.

uniform vec3 u_camera_position;  // model space
uniform mat3 u_camera_axes;      // columns: right, up, back; unit, model space
uniform vec4 u_window;           // left, bottom, width of a pixel, height of a pixel; on the plane at distance 1

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction) {
    origin = u_camera_position;
    direction = normalize(u_camera_axes * vec3(u_window.xy + pixel * u_window.zw, -1.0));
}
