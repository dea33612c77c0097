"""Columns of the nodes of a refraction table.

* DELAY: travel time less that of the straight ray from the image source [s].
* ARRIVAL: sine of the angle of travel at the point, positive down, less that of the straight ray [1].
* DEPARTURE: sine of the launch angle, positive towards the first boundary, less that of the straight ray [1].
* PRESSURE: pressure re that along the straight ray, both with spreading and absorption [1].
* GRAZING: sine of the grazing angle at the mean seabed, less that of the straight ray [1].
* BOUNCE, PERIOD: distance of the first bounce, and of each further one from that before, re that of the point [1].

All are 0 for a family without rays. The last column is not used: eight make one vector.
"""

DELAY, ARRIVAL, DEPARTURE, PRESSURE, GRAZING, BOUNCE, PERIOD = range(7)
COUNT = 8
